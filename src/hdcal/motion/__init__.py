"""How does a gear move under a force, and what did its motion tell?"""
