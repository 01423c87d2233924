"""Parts of the score: numbers with intervals, and what each of them is taken over."""
