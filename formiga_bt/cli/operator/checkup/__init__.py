"""What `formiga doctor` looks at: a table of checks (`table`), each a function that returns findings (`finding`)."""
