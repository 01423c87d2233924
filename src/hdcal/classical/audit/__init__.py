"""Does the article agree with its own numbers?"""
