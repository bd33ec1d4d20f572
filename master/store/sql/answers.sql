CREATE TABLE IF NOT EXISTS problems (
  hash TEXT PRIMARY KEY,
  problem BLOB NOT NULL        -- gapfarm.v1.Problem
) STRICT;
CREATE TABLE IF NOT EXISTS answers (
  question TEXT PRIMARY KEY,   -- hash of build, problem and task
  number INTEGER NOT NULL,     -- in the order in which they were first asked
  problem_hash TEXT NOT NULL REFERENCES problems,
  fingerprint TEXT NOT NULL,   -- of the build
  stage TEXT NOT NULL,         -- of the experiment that asked first
  task BLOB NOT NULL,          -- gapfarm.v1.Task
  result BLOB NOT NULL         -- gapfarm.v1.TaskResult
) STRICT;
CREATE TABLE IF NOT EXISTS command (  -- one row: what the command last said about itself
  id INTEGER PRIMARY KEY CHECK (id = 1),
  record TEXT NOT NULL         -- JSON, as `gapfarm status --json` prints it
) STRICT;
