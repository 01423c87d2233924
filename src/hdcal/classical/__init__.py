"""What do least-squares polynomials say?"""
