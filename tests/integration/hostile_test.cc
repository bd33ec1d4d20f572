// A run that is attacked by everybody at once ends as if nobody had.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/build_info.h"
#include "common/net/envelope.h"
#include "tests/integration/hostile_peers.h"
#include "tests/integration/run_program.h"
#include "worker/evaluate.h"

namespace gapfarm::hostile_test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsOurs = false;  // a sanitizer keeps what was freed
#else
constexpr bool kMemoryIsOurs = true;
#endif
constexpr std::size_t kHalfOpen = 3000;
// What the attack may cost at once: 12 kB a silent connection, one oversize handshake (60 MB) that
// came in whole before the guard's watch had its turn, and as much again as a calm run's jitter.
// Three rounds of that handshake alone, kept, would be 180 MB.
constexpr long kGrowthLimit_kB = 12 * static_cast<long>(kHalfOpen) + 61'440 + 10'000;

class Hostile : public testing::Test {
 protected:
  Hostile() {
    rlimit limit = {};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
    const KeyFolder master = KeyFolder::open_or_make(keys_).value();
    const KeyPair pair = make_key_pair("worker");
    EXPECT_TRUE(master.add_pair("master", make_key_pair("master")).ok());
    EXPECT_TRUE(master.add_pair("worker", pair).ok());
    EXPECT_TRUE(master.list({"worker", pair.public_key}).ok());
  }

  std::vector<std::string> evolve(const std::string& run, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"evolve",        GAPFARM_SOURCE_DIR "/configs/demo.toml",
                                          "--out",         folder_ / run,
                                          "--generations", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  std::string digest(const std::string& run) const {
    return status_of(folder_ / run).value("digest", "");
  }

  SocketOptions worker_link() const {
    SocketOptions options;
    options.security = worker_security(keys_).value();
    options.linger_s = 0;
    return options;
  }

  TemporaryFolder folder_;
  const std::string keys_ = folder_ / "keys";
};

v1::Envelope hello_of(const std::string& name) {
  v1::Envelope envelope;
  v1::Hello* hello = envelope.mutable_hello();
  hello->set_name(name);
  hello->set_host("nowhere");
  hello->set_fingerprint(build_info().fingerprint);
  hello->set_numeric_class(numeric_class());
  hello->set_window(4);
  return envelope;
}

// A listed worker that takes jobs and lies, until it is refused; then it comes again.
class Liar {
 public:
  enum Kind { kWrongIds, kNotANumber };
  Liar(std::string endpoint, SocketOptions options, Kind kind)
      : endpoint_(std::move(endpoint)), options_(std::move(options)), kind_(kind) {}

  unsigned lies() const { return lies_; }

  void round() {
    auto socket = DealerSocket::connect(endpoint_, options_);
    ASSERT_TRUE(socket.ok());
    v1::Envelope hello = hello_of("liar-" + std::to_string(kind_) + "-" + std::to_string(++life_));
    Message message;
    bool greeted = false;
    for (int i = 0; i < 20; ++i) {
      if (!greeted) greeted = (*socket)->send("", encode(&hello)) == SendStatus::kSent;
      (*socket)->wait({}, 0.05);
      while ((*socket)->receive(&message)) answer(message.bytes, **socket);
    }
    v1::Envelope goodbye;
    goodbye.mutable_goodbye()->set_reason("enough");
    (*socket)->send("", encode(&goodbye));
  }

 private:
  void answer(const std::string& bytes, DealerSocket& socket) {
    v1::Envelope envelope;
    if (decode(bytes, &envelope) != DecodeStatus::kOk) return;
    for (const v1::Job& job : envelope.batch().jobs()) {
      v1::Envelope lie;
      if (kind_ == kWrongIds) {
        add_lie(job, lie).set_job_id(job.job_id() + 1);
        add_lie(job, lie).set_job_id(job.job_id() - 1);
        add_lie(job, lie).set_attempt_id(job.attempt_id() + (1ULL << 40));
        add_lie(job, lie).set_epoch(job.epoch() + 1);
      } else {
        add_lie(job, lie).mutable_result()->mutable_evaluate()->set_fitness(
            std::numeric_limits<double>::quiet_NaN());
      }
      ++lies_;
      socket.send("", encode(&lie));
      socket.send("", std::string(1000, static_cast<char>(lies_.load())));  // no envelope at all
    }
  }

  static v1::JobResult& add_lie(const v1::Job& job, v1::Envelope& lie) {
    v1::JobResult* result = lie.mutable_results()->add_results();
    result->set_job_id(job.job_id());
    result->set_attempt_id(job.attempt_id());
    result->set_epoch(job.epoch());
    result->mutable_result()->set_outcome(v1::OK);
    result->mutable_result()->mutable_evaluate()->set_fitness(1e9);
    return *result;
  }

  std::string endpoint_;
  SocketOptions options_;
  Kind kind_;
  unsigned life_ = 0;
  std::atomic<unsigned> lies_{0};
};

// Tries to get in with a key that is not listed, or none; counts what it is reported.
class Intruder {
 public:
  Intruder(const std::string& endpoint, const SocketOptions& options)
      : socket_(DealerSocket::connect(endpoint, options).value()) {}
  void round() {
    v1::Envelope hello = hello_of("intruder");
    if (socket_->send("", encode(&hello)) == SendStatus::kSent) ++heard_;
    Message message;
    while (socket_->receive(&message)) ++heard_;
    socket_->wait({}, 0.02);
  }
  unsigned heard() const { return heard_; }

 private:
  std::unique_ptr<DealerSocket> socket_;
  std::atomic<unsigned> heard_{0};
};

// Where the master listens, read off what it shows its user.
std::string endpoint_of(const RunningProgram& master) {
  const std::string marker = "--connect ";
  for (;;) {
    const std::string output = master.err();
    const std::size_t at = output.find(marker);
    if (at != std::string::npos && output.find('\n', at) != std::string::npos) {
      const std::size_t begin = at + marker.size();
      return output.substr(begin, output.find_first_of(" \n", begin) - begin);
    }
    std::this_thread::yield();
  }
}

TEST_F(Hostile, ARunUnderAttackEndsAsIfNobodyHadBeenThere) {
  const std::vector<std::string> listening = {"--workers", "0",        "--keys",
                                              keys_,       "--listen", "tcp://127.0.0.1:*"};
  const auto worker_of = [&](const std::string& endpoint) {
    return std::vector<std::string>{"--connect", endpoint, "--keys", keys_, "--processes", "2"};
  };
  Finished calm;
  {
    RunningProgram master("gapfarm", evolve("calm", listening));
    RunningProgram worker("gapfarm-worker", worker_of(endpoint_of(master)));
    calm = master.wait();
  }
  ASSERT_EQ(calm.exit_code, 0) << calm.err;

  RunningProgram master("gapfarm", evolve("hostile", listening));
  const std::string endpoint = endpoint_of(master);
  const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  Recorder recorder(port);
  std::string recorded;
  {
    auto eavesdropped =
        DealerSocket::connect("tcp://127.0.0.1:" + std::to_string(recorder.port()), worker_link());
    ASSERT_TRUE(eavesdropped.ok());
    v1::Envelope hello = hello_of("eavesdropped");
    while ((*eavesdropped)->send("", encode(&hello)) != SendStatus::kSent) {
      (*eavesdropped)->wait({}, 0.01);
    }
    Message welcome;
    while (!(*eavesdropped)->receive(&welcome)) (*eavesdropped)->wait({}, 0.1);
    recorded = recorder.stop();
  }
  ASSERT_GT(recorded.size(), 300u);

  SocketOptions stranger = worker_link();
  stranger.security.own = make_key_pair("stranger");
  SocketOptions keyless = worker_link();
  keyless.security = {};
  keyless.security.open = OpenLinks::kAnywhere;
  SocketOptions other_master = worker_link();
  other_master.security.master_key = make_key_pair("other").public_key;
  HalfOpen half_open(port, kHalfOpen);
  Intruder unlisted(endpoint, stranger), open(endpoint, keyless), misled(endpoint, other_master);
  Liar wrong_ids(endpoint, worker_link(), Liar::kWrongIds);
  Liar not_a_number(endpoint, worker_link(), Liar::kNotANumber);
  {
    std::vector<std::unique_ptr<Attack>> attacks;
    const std::vector<std::function<void()>> rounds = {[&] { half_open.round(); },
                                                       [&] { send_garbage(port); },
                                                       [&] { send_oversize_handshake(port); },
                                                       [&] { send_impossible_length(port); },
                                                       [&] { greet_without_keys(port); },
                                                       [&] { greet_byte_by_byte(port); },
                                                       [&] { replay(port, recorded); },
                                                       [&] { unlisted.round(); },
                                                       [&] { open.round(); },
                                                       [&] { misled.round(); },
                                                       [&] { wrong_ids.round(); },
                                                       [&] { not_a_number.round(); }};
    for (const auto& round : rounds) attacks.push_back(std::make_unique<Attack>(round));
    // Everybody has had a go before an honest worker comes, and goes on afterwards.
    for (const auto& attack : attacks) attack->wait_for_rounds(3);
    RunningProgram worker("gapfarm-worker", worker_of(endpoint));
    const Finished finished = master.wait();
    EXPECT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_THAT(finished.err, testing::HasSubstr(stranger.security.own->public_key));
    if (kMemoryIsOurs) {
      EXPECT_LT(finished.peak_memory_kB - calm.peak_memory_kB, kGrowthLimit_kB);
    }
    RecordProperty("calm_kB", std::to_string(calm.peak_memory_kB));
    RecordProperty("hostile_kB", std::to_string(finished.peak_memory_kB));
  }
  EXPECT_EQ(unlisted.heard() + open.heard() + misled.heard(), 0u);
  EXPECT_GT(wrong_ids.lies(), 0u);
  EXPECT_GT(not_a_number.lies(), 0u);
  EXPECT_NE(digest("calm"), "");
  EXPECT_EQ(digest("hostile"), digest("calm"));
}

TEST_F(Hostile, LocalWorkersWorkBesideAnEndpointWithKeys) {
  const Finished both = gapfarm_command(
      evolve("both", {"--workers", "1", "--keys", keys_, "--listen", "tcp://127.0.0.1:*"}));
  EXPECT_EQ(both.exit_code, 0) << both.err;
}

TEST(Keys, ThatCannotBeAreWrongInput) {
  const TemporaryFolder folder;
  const std::string keys = folder / "keys", file = folder.write("file", "");
  ASSERT_EQ(gapfarm_command({"keys", "make", "--keys", keys}).exit_code, 0);
  EXPECT_EQ(gapfarm_command({"keys", "list", "--keys", folder / "none"}).exit_code, 2);
  EXPECT_EQ(gapfarm_command({"keys", "revoke", "rack9", "--keys", keys}).exit_code, 2);
  EXPECT_EQ(gapfarm_command({"keys", "make", "--keys", file}).exit_code, 2);
  EXPECT_EQ(gapfarm_command({"keys", "make", "--keys", "/proc/nowhere"}).exit_code, 2);
}

}  // namespace gapfarm::hostile_test
