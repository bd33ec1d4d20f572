#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "common/base/text.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm::site_test {

ClusterSite shipped_site(const std::string& system) {
  const std::string path = std::string(GAPFARM_SOURCE_DIR) + "/configs/sites/" + system + ".toml";
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const auto site = parse_site(text.str(), path);
  EXPECT_TRUE(site) << (site ? "" : site.error().message);
  return site ? *site : ClusterSite{};
}

std::string ids_of(const std::vector<ListedJob>& jobs) {
  std::string all;
  for (const ListedJob& job : jobs) {
    const char* standing[] = {"queued", "runs", "stuck"};
    all += job.id + " " + standing[job.standing] + " " + job.node + "\n";
  }
  return all;
}

TEST(Sites, EveryShippedFileIsWhole) {
  for (const char* system : {"slurm", "sge", "pbs", "condor", "kube", "ssh", "local"}) {
    const ClusterSite site = shipped_site(system);
    EXPECT_EQ(site.system, system);
    EXPECT_NE(site.script.find("{worker}"), std::string::npos) << system;
    EXPECT_FALSE(site.log.empty()) << system;
  }
}

TEST(Sites, PlaceholdersAreReplacedAndLonelyOnesSplice) {
  const SiteValues values = {{"a", {"1"}}, {"none", {}}, {"two", {"x", "y z"}}};
  EXPECT_EQ(expand(std::vector<std::string>{"p{a}", "{none}", "{two}", "${HOME} {b}"}, values),
            (std::vector<std::string>{"p1", "x", "y z", "${HOME} {b}"}));
  EXPECT_EQ(expand("{two}\n{none}.", values), "x\ny z\n.");
  EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_quoted("run/my robot"), "'run/my robot'");
  EXPECT_EQ(shell_quoted("run/robot-1"), "run/robot-1");
}

// What the systems' commands printed, kept as they printed it.
TEST(Sites, SlurmIsUnderstood) {
  const ClusterSite site = shipped_site("slurm");
  EXPECT_EQ(ids_of(parse_list(site, "gf01234567",
                              "4711_0|RUNNING|node-3|None\n4711_1|PENDING||Resources\n"
                              "4712_0|COMPLETING|node-4|None\n4713_0|SUSPENDED|node-5|None\n"
                              "4714_0|PREEMPTED|node-5|None\n")),
            "4711_0 runs node-3\n4711_1 queued \n4712_0 runs node-4\n4713_0 runs node-5\n");
  EXPECT_EQ(parse_submitted(site, 2, "4711;cluster\n"),
            (std::vector<std::string>{"4711_0", "4711_1"}));
  EXPECT_TRUE(is_site_limit(
      site,
      "sbatch: error: AssocMaxSubmitJobLimit\nsbatch: error: Batch job submission failed: Job "
      "violates accounting/QOS policy (job submit limit, user's size and/or time limits)\n"));
  EXPECT_FALSE(is_site_limit(site, "sbatch: error: invalid partition specified: shrot\n"));
}

TEST(Sites, GridEngineIsUnderstood) {
  const ClusterSite site = shipped_site("sge");
  const std::string listed =
      R"(job-ID  prior   name       user         state submit/start at     queue                          slots ja-task-ID 
-----------------------------------------------------------------------------------------------------------------
      3 0.55500 gfabcdef01 root         r     11/24/2026 12:42:59 all.q@vm                           1 1
      3 0.50000 gfabcdef01 root         dr    11/24/2026 12:42:59 all.q@vm                           1 2
      3 0.50000 gfabcdef01 root         qw    11/24/2026 12:42:59                                    1 3
      3 0.50000 gfabcdef01 root         Eqw   11/24/2026 12:42:59                                    1 4
      4 0.25000 gf2        root         qw    11/24/2026 12:43:08                                    1        
)";
  EXPECT_EQ(ids_of(parse_list(site, "gfabcdef01", listed)),
            "3.1 runs vm\n3.2 runs vm\n3.3 queued \n3.4 stuck \n");
  EXPECT_EQ(parse_submitted(site, 2, "3.1-2:1\n"), (std::vector<std::string>{"3.1", "3.2"}));
  EXPECT_TRUE(is_site_limit(site,
                            "Unable to run job: job rejected: only 4 jobs are allowed per user "
                            "(current job count: 4)\nExiting.\n"));
}

// Written after the manual, not printed by a PBS, of which Debian has no package: `qstat -n -1 -u
// USER` has the columns of "Displaying Job Status in Alternate Format" of the PBS Professional
// 2020.1 user's guide (OpenPBS 20 is the same), and -n -1 the host behind them; letters of states
// as in qstat(1B).
TEST(Sites, PbsIsUnderstood) {
  const ClusterSite site = shipped_site("pbs");
  const std::string listed = R"(
pbs:
                                                            Req'd  Req'd   Elap
Job ID          Username Queue    Jobname    SessID NDS TSK Memory Time  S Time
--------------- -------- -------- ---------- ------ --- --- ------ ----- - -----
12.pbs          root     workq    gf01234567   8213   1   8    --  01:00 R 00:03 node-1/0*8
13.pbs          root     workq    gf01234567    --    1   8    --  01:00 Q   --   -- 
14.pbs          root     workq    other         --    1   8    --  01:00 Q   --   -- 
15.pbs          root     workq    gf01234567    --    1   8    --  01:00 F 00:01 node-2/0*8
)";
  const auto jobs = parse_list(site, "gf01234567", listed);
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].node, "node-1");
  EXPECT_EQ(jobs[0].standing, ListedJob::kRuns);
  EXPECT_EQ(jobs[1].id, "13");
  EXPECT_EQ(jobs[1].standing, ListedJob::kQueued);
  EXPECT_EQ(parse_submitted(site, 1, "12.pbs\n"), (std::vector<std::string>{"12"}));
  EXPECT_TRUE(
      is_site_limit(site, "qsub: would exceed complex's per-user limit of jobs in 'Q' state\n"));
}

// Printed by HTCondor 23.9.6 of Debian 13, of one machine, with MAX_JOBS_PER_OWNER = 4.
TEST(Sites, CondorIsUnderstood) {
  const ClusterSite site = shipped_site("condor");
  EXPECT_EQ(parse_submitted(site, 3, "24.0 - 24.2\n"),
            (std::vector<std::string>{"24.0", "24.1", "24.2"}));
  EXPECT_EQ(ids_of(parse_list(site, "gf01234567",
                              "24.0 1 undefined undefined\n24.1 1 undefined undefined\n")),
            "24.0 queued \n24.1 queued \n");
  const auto jobs = parse_list(site, "gf01234567",
                               "24.0 7 slot1_1@localhost.vm undefined\n"
                               "24.1 2 slot1_2@localhost.vm undefined\n"
                               "25.0 5 undefined Error from slot1_4@localhost.vm: Failed to "
                               "execute '/opt/none': (errno=2: 'No such file or directory')\n");
  EXPECT_EQ(ids_of(jobs), "24.0 runs localhost.vm\n24.1 runs localhost.vm\n25.0 stuck \n");
  ASSERT_EQ(jobs.size(), 3u);
  EXPECT_EQ(jobs[0].reason, "");
  EXPECT_EQ(jobs[2].reason.rfind("Error from slot1_4@localhost.vm: Failed to execute", 0), 0u);
  EXPECT_TRUE(is_site_limit(site,
                            "\nERROR: Failed to create proc\n"
                            "Number of submitted jobs would exceed MAX_JOBS_PER_OWNER\n"));
}

TEST(Sites, KubernetesIsUnderstood) {
  const ClusterSite site = shipped_site("kube");
  EXPECT_EQ(ids_of(parse_list(site, "gf01234567",
                              "gf01234567-x2k9p   Running     node-1   <none>\n"
                              "gf01234567-a1b2c   Pending     <none>   0/3 nodes are available\n"
                              "gf01234567-d4e5f   Succeeded   node-1   <none>\n"
                              "gf01234567-g7h8i   Failed      node-2   <none>\n")),
            "gf01234567-x2k9p runs node-1\ngf01234567-a1b2c queued \n");
  EXPECT_EQ(
      parse_submitted(site, 2, "pod/gf01234567-x2k9p created\npod/gf01234567-a1b2c created\n"),
      (std::vector<std::string>{"gf01234567-x2k9p", "gf01234567-a1b2c"}));
  EXPECT_TRUE(
      is_site_limit(site, "Error from server (Forbidden): pods is forbidden: exceeded quota"));
}

TEST(Sites, WhatIsMissingOrUnknownIsNamed) {
  const auto unknown = parse_site("system = 'x'\nsubmitt = ['y']\n", "x.toml");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().message.find("x.toml:2"), std::string::npos) << unknown.error().message;
  const auto missing = parse_site("system = 'x'\n", "x.toml");
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().message.find("'submit'"), std::string::npos) << missing.error().message;
}

// A cluster of three jobs at most, as commands see it.
class PretendedCluster {
 public:
  Fleet::Runner runner() {
    return [this](const std::vector<std::string>& command, const std::string&) {
      return Result<Captured>(answer(command));
    };
  }
  Captured answer(const std::vector<std::string>& command) {
    Captured out;
    if (command[0] == "squeue") {
      for (const auto& [id, state] : jobs) out.out += id + "|" + state + "|node|None\n";
    } else if (command[0] == "sbatch") {
      ++submissions;
      const auto array = std::find_if(command.begin(), command.end(), [](const auto& word) {
        return word.rfind("--array=0-", 0) == 0;
      });
      const std::size_t count = std::stoul(array->substr(10)) + 1;
      if (jobs.size() + count > 3) {
        out.status = 256;
        out.err = "sbatch: error: AssocMaxSubmitJobLimit";
        return out;
      }
      ++last;
      for (std::size_t i = 0; i < count; ++i) {
        jobs[std::to_string(last) + "_" + std::to_string(i)] = "RUNNING";
      }
      out.out = std::to_string(last) + "\n";
    } else if (command[0] == "scancel" && deaf > 0) {
      --deaf;
      out.status = 256;
      out.err = "scancel: error: Unable to contact slurm controller";
    } else if (command[0] == "scancel") {
      for (std::size_t i = 1; i < command.size(); ++i) jobs.erase(command[i]);
    } else if (command[0] == "tail") {
      out.out = "error while loading shared libraries: libzmq.so.5\n";
    }
    most = std::max(most, jobs.size());
    return out;
  }

  std::map<std::string, std::string> jobs;
  std::size_t most = 0;
  unsigned submissions = 0, last = 100;
  unsigned deaf = 0;  // to so many requests to take jobs away
};

struct PretendedFleet {
  explicit PretendedFleet(unsigned most) {
    options.site = shipped_site("slurm");
    options.name = "gf01234567";
    options.limits.max_workers = most;
    options.worker = {"gapfarm-worker", "--connect", "tcp://m:1"};
    fleet = std::make_unique<Fleet>(options, cluster.runner(),
                                    [this](const std::string& note) { notes += note + "\n"; });
  }
  void look(double now, std::uint64_t unfinished, bool joined = true) {
    v1::Backlog backlog;
    backlog.set_unfinished(unfinished);
    for (const auto& [id, state] : cluster.jobs) {
      if (joined) backlog.add_workers()->set_name("gf01234567-" + id + "-77-abcdef-1.1");
    }
    fleet->look(&backlog, now);
  }
  FleetOptions options;
  PretendedCluster cluster;
  std::string notes;
  std::unique_ptr<Fleet> fleet;
};

TEST(Fleets, KeepToTheSitesLimitAndReplaceWhatEnds) {
  PretendedFleet farm(8);
  for (double now = 0; now < 120; now += 15) farm.look(now, 100);
  EXPECT_EQ(farm.cluster.jobs.size(), 3u);
  EXPECT_LE(farm.cluster.submissions, 6u);
  EXPECT_NE(farm.fleet->status().why.find("no more than 3"), std::string::npos);
  farm.cluster.jobs.erase(farm.cluster.jobs.begin());
  farm.look(130, 100);
  EXPECT_EQ(farm.cluster.jobs.size(), 3u);
  EXPECT_EQ(farm.fleet->status().lost, 0u);
  EXPECT_FALSE(farm.fleet->drain(140));
  EXPECT_TRUE(farm.fleet->drain(160));
  EXPECT_TRUE(farm.cluster.jobs.empty());
}

TEST(Fleets, TakeJobsAwayUntilTheyAreGoneAndComplainTheSecondTime) {
  PretendedFleet farm(3);
  farm.look(0, 100);
  farm.cluster.deaf = 2;
  EXPECT_FALSE(farm.fleet->drain(10));
  EXPECT_EQ(farm.notes.find("cannot take away"), std::string::npos) << farm.notes;
  EXPECT_FALSE(farm.fleet->drain(11));
  EXPECT_NE(farm.notes.find("Unable to contact"), std::string::npos) << farm.notes;
  EXPECT_FALSE(farm.fleet->drain(12));
  EXPECT_TRUE(farm.fleet->drain(13));
  EXPECT_TRUE(farm.cluster.jobs.empty());
}

TEST(Fleets, ShowTheLogOfWhatDiedAtOnceAndBackOff) {
  PretendedFleet farm(2);
  for (double now = 0; now < 1000; now += 15) {
    farm.look(now, 100, false);
    farm.cluster.jobs.clear();
  }
  EXPECT_NE(farm.notes.find("libzmq.so.5"), std::string::npos) << farm.notes;
  // After 30, 60, 120, ... s.
  EXPECT_LE(farm.cluster.submissions, 9u);
  EXPECT_GE(farm.fleet->status().lost, 4u);
}

TEST(Fleets, ReportTheClustersReasonForAJobThatIsStuck) {
  PretendedFleet farm(1);
  farm.options.site = shipped_site("condor");
  std::string listed = "25.0 5 undefined Error from slot1_4@localhost.vm: Failed to execute\n";
  Fleet fleet(
      farm.options,
      [&](const std::vector<std::string>& command, const std::string&) {
        Captured out;
        if (command[0] == "condor_q") out.out = listed;
        if (command[0] == "condor_rm") listed.clear();
        return Result<Captured>(out);
      },
      [&](const std::string& note) { farm.notes += note + "\n"; });
  v1::Backlog backlog;
  for (double now = 0; now < 3; ++now) fleet.look(&backlog, now);
  EXPECT_NE(farm.notes.find("job 25.0 ended before its worker joined the master; the cluster's "
                            "reason: Error from slot1_4@localhost.vm"),
            std::string::npos)
      << farm.notes;
}

}  // namespace gapfarm::site_test
