"""Which effects can the model include?"""
