"""What a record says of its controller, without any model of the arm."""
