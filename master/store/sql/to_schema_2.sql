ALTER TABLE progress ADD COLUMN
  farm TEXT NOT NULL DEFAULT '{}' /* JSON object: counts over all masters of this run */;
CREATE TABLE incidents (       -- what somebody should look at, as it happened
  generation INTEGER NOT NULL, -- in work then
  kind TEXT NOT NULL,          -- quarantine: a task was given up; alarm: two answers to one task
  time REAL NOT NULL,          -- Unix time
  text TEXT NOT NULL
) STRICT;
