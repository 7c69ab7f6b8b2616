"""Who may do what: tokens, roles, one-time tickets; and what browsers may not do behind a person's back."""
