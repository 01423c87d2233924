"""How stiff is each of many gears, and which of them are not like the others?"""
