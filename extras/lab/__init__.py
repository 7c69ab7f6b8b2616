"""What a laboratory adds to one arm at one computer."""
