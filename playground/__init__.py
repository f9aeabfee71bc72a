"""The playground: a page on which a reader changes the range of a flying flock."""
