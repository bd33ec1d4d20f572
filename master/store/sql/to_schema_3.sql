CREATE TABLE documents (       -- what was worked out once, so that a report needs no simulation
  name TEXT PRIMARY KEY,       -- "outcome": the log as the best predicts it (docs/run_store.md)
  generation INTEGER NOT NULL, -- it is of
  content TEXT NOT NULL        -- JSON
) STRICT;
