// A farm with a fleet of workers that need no cores.
#pragma once

#include <cstdio>
#include <memory>

#include "common/base/clock.h"
#include "tests/bench/bench_farm_setup.h"
#include "tests/bench/echo_fleet.h"

namespace gapfarm {

// Ready once the whole fleet has joined.
struct FleetBench {
  FleetBench(Link link, unsigned workers, double service_s) {
    SocketFarmOptions options;
    options.on_event = [](const FarmEvent&) {};
    options.listen = {"tcp://127.0.0.1:*"};
    options.security.open = OpenLinks::kLoopback;
    if (link == kCurve) options.security = master_security(keys.path()).value();
    farm = std::move(SocketFarm::create(options)).value();
    FleetOptions many;
    many.endpoint = farm->endpoints().at(0);
    many.security.open = OpenLinks::kLoopback;
    if (link == kCurve) many.security = worker_security(keys.path()).value();
    many.workers = workers;
    many.service_s = service_s;
    const double begun = monotonic_seconds();
    fleet = std::make_unique<EchoFleet>(many);
    while (farm->workers().size() < workers) run(100);
    join_s = monotonic_seconds() - begun;
  }

  void run(std::size_t count) {
    if (!farm->run("", echo_tasks(count, 0, 100))) std::fprintf(stderr, "a run failed\n");
  }

  BenchKeys keys;
  std::unique_ptr<SocketFarm> farm;
  std::unique_ptr<EchoFleet> fleet;
  double join_s = 0;
};

}  // namespace gapfarm
