CREATE TABLE run (             -- one row: what was fixed when the run was created
  id INTEGER PRIMARY KEY CHECK (id = 1),
  program_version TEXT NOT NULL,
  fingerprint TEXT NOT NULL,   -- of the build
  created TEXT NOT NULL,       -- UTC
  config_path TEXT NOT NULL,
  config TEXT NOT NULL,        -- the file's text
  overrides TEXT NOT NULL,     -- JSON, command-line options
  problem BLOB NOT NULL,       -- gapfarm.v1.Problem
  problem_hash TEXT NOT NULL,
  seed TEXT NOT NULL,          -- unsigned 64 bits, decimal
  numeric_class TEXT NOT NULL,
  fitness TEXT NOT NULL,
  fitness_unit TEXT NOT NULL,
  higher_is_better INTEGER NOT NULL
) STRICT;
CREATE TABLE generations (
  generation INTEGER PRIMARY KEY,
  best REAL, mean REAL, median REAL, worst REAL,  -- fitness over the OK individuals
  diversity REAL NOT NULL,
  operator_probabilities TEXT NOT NULL,           -- JSON object
  evaluations INTEGER NOT NULL,                   -- since the run began
  wall_s REAL NOT NULL,                           -- of this generation
  quarantined INTEGER NOT NULL,
  optimiser_state BLOB NOT NULL,                  -- after this generation
  digest TEXT NOT NULL                            -- over this and all earlier generations
) STRICT;
CREATE TABLE individuals (
  generation INTEGER NOT NULL REFERENCES generations ON DELETE CASCADE,
  rank INTEGER NOT NULL,       -- 0: best
  birth_id INTEGER NOT NULL,
  genome BLOB NOT NULL,        -- doubles in [0, 1], the machine's byte order
  parameters TEXT NOT NULL,    -- JSON object: parameter to value
  outcome TEXT NOT NULL,
  fitness REAL,                -- NULL unless the outcome is OK
  scores INTEGER NOT NULL,     -- evaluations behind the fitness
  parents TEXT NOT NULL,       -- JSON array of birth ids
  operators TEXT NOT NULL,
  PRIMARY KEY (generation, rank)
) STRICT;
CREATE INDEX individuals_by_birth ON individuals (birth_id);
CREATE TABLE progress (        -- one row: what the master last said about itself
  id INTEGER PRIMARY KEY CHECK (id = 1),
  state TEXT NOT NULL,
  stop_reason TEXT NOT NULL,   -- while it runs: what it waits for
  pid INTEGER NOT NULL,
  host TEXT NOT NULL,
  heartbeat REAL NOT NULL,     -- Unix time
  rate_per_s REAL NOT NULL,
  time_left_s REAL,
  done INTEGER NOT NULL,       -- tasks of the generation in work
  total INTEGER NOT NULL,
  workers TEXT NOT NULL,       -- JSON array
  epoch INTEGER NOT NULL       -- masters that have written to this run
) STRICT;
