"""What was found, in sentences and in lines and tables of the terminal."""
