#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/net/envelope.h"
#include "common/net/master_wait.h"
#include "common/net/socket.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm {
namespace {

constexpr double kReportInterval_s = 2;
constexpr double kAnswerLimit_s = 15;    // a master that is silent for so long is not there
constexpr double kCommandLimit_s = 120;  // for a cluster's command
constexpr double kDrainInterval_s = 1;

class Loop {
 public:
  Loop(const FleetLoopOptions& options, StopSource& stop,
       const std::function<void(const std::string&)>& note)
      : options_(options),
        stop_(stop),
        note_(note),
        fleet_(
            options.fleet,
            [this](const auto& command, const std::string& input) {
              return run_command(command, input);
            },
            note),
        wait_(options.endpoint, options.master_limit_s) {}

  Result<FleetEnd> run() {
    SocketOptions links;
    links.security = options_.security;
    ASSIGN_OR_RETURN(socket_, DealerSocket::connect(options_.endpoint, links));
    std::optional<FleetEnd> end;
    while (!end) {
      const double now = monotonic_seconds();
      receive(now);
      if (refused_) {
        return Error{"the master at " + options_.endpoint +
                     " is of another build and knows no fleets; use the same build"};
      }
      if (const auto text = wait_.message(master_is_there(now), now)) note_(*text);
      report(now);
      if (now >= next_look_s_ && !goodbye_) look(now);
      if (goodbye_) end = FleetEnd::kMasterLeft;
      if (stop_.requested()) end = FleetEnd::kStopped;
      if (wait_.is_over(now)) {
        note_(wait_.over());
        end = FleetEnd::kNoMaster;
      }
      if (!end) sleep(now);
    }
    RETURN_IF_ERROR(take_away());
    return *end;
  }

 private:
  // Messages are read meanwhile: those that a connection brought are lost when it ends unread, and
  // the master's last one is the one that matters.
  Result<Captured> run_command(const std::vector<std::string>& command, const std::string& input) {
    ChildSetup setup;
    setup.arguments = command;
    setup.leads_group = true;  // Ctrl-C is for this process
    return run_captured(std::move(setup), input, kCommandLimit_s, [this](int fd, double left_s) {
      const std::array<int, 1> fds = {fd};
      socket_->wait(fds, left_s);
      receive(monotonic_seconds());
    });
  }

  bool master_is_there(double now) const { return backlog_ && now - heard_s_ < kAnswerLimit_s; }

  void receive(double now) {
    Message message;
    v1::Envelope envelope;
    while (socket_->receive(&message)) {
      if (decode(message.bytes, &envelope) != DecodeStatus::kOk) continue;
      if (envelope.has_hello_request() || envelope.has_refusal()) {
        refused_ = true;
      }
      if (envelope.has_goodbye()) {
        goodbye_ = true;
        socket_->send("", encode(&envelope));  // the master waits for it
      }
      if (!envelope.has_backlog()) continue;
      // The first look waits for the first answer.
      if (!backlog_) next_look_s_ = now;
      backlog_ = std::move(*envelope.mutable_backlog());
      heard_s_ = now;
      fleet_.hear(*backlog_);
    }
    const std::string trouble = socket_->take_trouble();
    if (!trouble.empty()) note_(trouble + "; trying again");
  }

  void report(double now) {
    if (now < next_report_s_) return;
    next_report_s_ = now + kReportInterval_s;
    const FleetStatus status = fleet_.status();
    v1::Envelope envelope;
    v1::Fleet* fleet = envelope.mutable_fleet();
    fleet->set_name(status.name);
    fleet->set_system(status.system);
    fleet->set_host(host_name());
    fleet->set_wanted(status.wanted);
    fleet->set_queued(status.queued);
    fleet->set_running(status.running);
    fleet->set_lost(status.lost);
    fleet->set_why(status.why);
    socket_->send("", encode(&envelope));
  }

  void look(double now) {
    next_look_s_ = now + options_.fleet.site.interval_s;
    if (!backlog_) return;
    if (now - heard_s_ > options_.wait_limit_s) {
      if (!away_) note_("the workers are taken away, for want of a master");
      away_ = true;
      fleet_.drain(now);
      return;
    }
    away_ = false;
    fleet_.look(master_is_there(now) ? &*backlog_ : nullptr, now);
    next_report_s_ = now;  // what has changed is reported at once
  }

  void sleep(double now) {
    const std::array<int, 1> fds = {stop_.fd()};
    socket_->wait(fds, std::clamp(std::min(next_report_s_, next_look_s_) - now, 0.01, 1.0));
  }

  Status take_away() {
    const double until = monotonic_seconds() + options_.drain_limit_s;
    while (!fleet_.drain(monotonic_seconds())) {
      if (monotonic_seconds() >= until) {
        return Error{"jobs named " + options_.fleet.name +
                     " still stand on the cluster; they end when their workers find no master, or "
                     "take them away by hand"};
      }
      socket_->wait({}, kDrainInterval_s);
    }
    return {};
  }

  const FleetLoopOptions& options_;
  StopSource& stop_;
  const std::function<void(const std::string&)>& note_;
  Fleet fleet_;
  std::unique_ptr<DealerSocket> socket_;
  MasterWait wait_;
  std::optional<v1::Backlog> backlog_;  // the last
  double heard_s_ = 0, next_report_s_ = 0, next_look_s_ = 0;
  bool goodbye_ = false, away_ = false, refused_ = false;
};

}  // namespace

Result<FleetEnd> run_fleet(const FleetLoopOptions& options, StopSource& stop,
                           const std::function<void(const std::string&)>& note) {
  return Loop(options, stop, note).run();
}

}  // namespace gapfarm
