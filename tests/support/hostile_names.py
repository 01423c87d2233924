"""Names as a file could hold them to break a page, a figure or a terminal."""

NAMES = [
    "<script>alert(1)</script>",
    "\"><img src=x onerror='alert(1)'>",
    "]]></title>&amp;--><!--",
    "$x^{$ \\frac{1}",
    "a\x00b\x1b[31m\x07\u202e",
    "谐波减速器 🦾",
    "{{ 7 * 7 }}{% raw %}",
    "n" * 200,
]
