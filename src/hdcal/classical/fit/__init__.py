"""What do classical polynomials give?"""
