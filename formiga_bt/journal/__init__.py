"""The journal: every step of the engine, on disk before its effects leave; and every past moment of a site, from there.

    codec     a step as bytes, and back as it was            thin     statuses that changed nothing become way points
    schema    tables, and how an older journal becomes new   writer   the driver's seam: durable, then effects leave
    store     a journal: append, who may write               reading  steps, snapshots, way points, files
    past      the state and the board at any moment          keep     retention, compaction, figures
    database  SQLite and PostgreSQL, and their differences   export   tables for other programs

SQL stands here only. Nothing below knows of it; who drives an engine is handed a `Writer`.
"""
