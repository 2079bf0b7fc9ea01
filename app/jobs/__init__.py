"""Background work: rows in the database, a dispatcher thread, one executor; knows nothing of learning."""
