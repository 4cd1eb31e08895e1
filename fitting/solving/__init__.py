"""What a fit is made of: the vector of unknowns, its box, standard sizes, error bars."""
