"""All SQL: tables, the door through which units of work pass, and their queries."""
