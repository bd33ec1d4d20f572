#include "tests/bench/farm_model.h"

#include <gtest/gtest.h>

namespace gapfarm::farm_model_test {

// The machine repairman with exponential times, exactly: Erlang's formula for a finite source.
double repairman_rate(unsigned machines, double working_s, double repair_s) {
  double term = 1, sum = 1;
  for (unsigned k = 1; k <= machines; ++k) {
    term *= (machines - k + 1) * repair_s / working_s;
    sum += term;
  }
  return (1 - 1 / sum) / repair_s;
}

TEST(FarmModel, IsTheMachineRepairmanWithAWindowOfOne) {
  for (const unsigned workers : {1u, 5u, 50u, 90u, 110u, 200u, 1000u}) {
    FarmModel model;
    model.workers = workers;
    model.window = 1;
    model.service_s = 0.01;
    model.main_s = 1e-4;
    const double exact = repairman_rate(workers, model.service_s, model.main_s);
    EXPECT_NEAR(forecast(model).tasks_per_s, exact, 0.06 * exact) << workers;
  }
}

TEST(FarmModel, ALightlyLoadedMasterKeepsAllWorkersBusy) {
  FarmModel model;
  model.workers = 10;
  model.service_s = 0.01;
  model.main_s = model.link_s = 1e-6;
  const FarmForecast forecasted = forecast(model);
  EXPECT_NEAR(forecasted.tasks_per_s, 1000, 1);
  EXPECT_NEAR(forecasted.efficiency, 1, 1e-3);
  EXPECT_NEAR(forecasted.round_trip_s, 2e-6, 1e-7);
}

TEST(FarmModel, TheSlowerThreadBoundsAnOverloadedMaster) {
  FarmModel model;
  model.workers = 2000;
  model.service_s = 1e-3;
  model.main_s = 10e-6;
  model.link_s = 25e-6;
  EXPECT_NEAR(forecast(model).tasks_per_s, 40000, 40);
  model.main_s = 50e-6;
  EXPECT_NEAR(forecast(model).tasks_per_s, 20000, 20);
  EXPECT_NEAR(forecast(model).efficiency, 0.01, 1e-4);
}

TEST(FarmModel, SharedCoresBoundEverybodyTogether) {
  FarmModel model;
  model.workers = 500;
  model.service_s = 1e-3;
  model.main_s = 5e-6;
  model.link_s = 10e-6;
  model.shared_s = 40e-6 / 2;
  EXPECT_NEAR(forecast(model).tasks_per_s, 50000, 50);
}

TEST(FarmModel, ConnectionsTakeTheirShare) {
  FarmModel model;
  model.workers = 5000;
  model.service_s = 1;
  model.link_s = 20e-6;
  model.link_idle = 1e-4;
  EXPECT_NEAR(forecast(model).efficiency, 1, 0.01);
  model.service_s = 0.01;
  EXPECT_NEAR(forecast(model).tasks_per_s, 0.5 / 20e-6, 30);
  model.workers = 10001;
  EXPECT_EQ(forecast(model).tasks_per_s, 0);
}

TEST(FarmModel, CarriesAsManyWorkersAsStayBusy) {
  FarmModel model;
  model.service_s = 0.01;
  model.main_s = 10e-6;
  const unsigned carried = workers_carried(model, 0.95, 100000);
  EXPECT_GT(carried, 900u);
  EXPECT_LE(carried, 1050u);
  model.workers = carried;
  EXPECT_GE(forecast(model).efficiency, 0.95);
  model.workers = carried + 1;
  EXPECT_LT(forecast(model).efficiency, 0.95);
  EXPECT_EQ(workers_carried(model, 0.95, 300), 300u);
}

TEST(FarmModel, AWindowHidesTheWayToTheMaster) {
  FarmModel model;
  model.workers = 4;
  model.service_s = 1e-3;
  model.delay_s = 1e-3;
  model.window = 1;
  EXPECT_NEAR(forecast(model).efficiency, 0.5, 1e-6);
  double before = 0.5;
  for (const unsigned window : {2u, 4u, 16u}) {
    model.window = window;
    EXPECT_GT(forecast(model).efficiency, before);
    before = forecast(model).efficiency;
  }
  EXPECT_GT(before, 0.9);
}

}  // namespace gapfarm::farm_model_test
