"""The nearest tree that passes: small edits of a draft, tried by a program, judged anew, and told."""
