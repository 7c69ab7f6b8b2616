"""Independent test rigs: arms, loops and laws that share no code with the product, and effects to hide in them."""
