"""What do curve fits say, and what does the article claim?"""
