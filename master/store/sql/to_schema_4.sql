CREATE TABLE worker_events (   -- who came and went, and why
  time REAL NOT NULL,          -- Unix time
  kind TEXT NOT NULL,          -- joined, returned, left, silent, died, refused; master, end (of one)
  worker TEXT NOT NULL,        -- its name; of a master: empty
  host TEXT NOT NULL,
  text TEXT NOT NULL
) STRICT;
