#include <flyball/estimation/delayed_filter.hpp>

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include <flyball/core/random.hpp>
#include <flyball/estimation/guarded_filter.hpp>
#include <flyball/estimation/model_filter.hpp>

#include "field_drive.hpp"
#include "support/allocation_count.hpp"

namespace flyball::delayed_filter_test {
namespace {

using Filter = ExtendedKalmanFilter<test::FieldDrive>;
using Vector5 = Eigen::Vector<double, 5>;

/// A beacon, or a whole position.
struct Seen {
  struct Beacon {
    std::size_t number = 0;
    Eigen::Vector2d y{};
  };
  struct Position {
    Eigen::Vector2d y{};
  };
  std::variant<Beacon, Position> what;

  UpdateStatus operator()(Filter& filter) const noexcept {
    if (const auto* beacon = std::get_if<Beacon>(&what)) {
      return filter
          .correct(beacon->y, test::Sighting{test::beacons[beacon->number]}, test::sighting_noise(),
                   {}, AngleDifference<1>{})
          .status;
    }
    const auto position = [](const auto& x) { return x.template head<2>().eval(); };
    return filter
        .correct(std::get<Position>(what).y, position,
                 MeasurementNoise<2>::independent(Eigen::Vector2d(0.01, 0.01)))
        .status;
  }
};

Filter made() {
  const Eigen::MatrixXd Q = 1e-4 * Eigen::MatrixXd::Identity(5, 5);
  return Filter::create(test::FieldDrive{}, Q, standard_deviations({0.01, 0.02, 0.02}),
                        {Vector5::Zero(), Eigen::MatrixXd(0.1 * Eigen::MatrixXd::Identity(5, 5))},
                        Time(0.02))
      .value();
}

struct Timed {
  double time;
  double arrival;
  Seen seen;
};

Seen seen_at(Random& random, int k) {
  if (k % 3 == 0) {
    return {Seen::Position{{0.02 * k + 0.1 * random.normal(), 0.1 * random.normal()}}};
  }
  const auto number = static_cast<std::size_t>(k % 4);
  Vector5 x = Vector5::Zero();
  x(0) = 0.02 * k;
  const Eigen::Vector2d y = test::Sighting{test::beacons[number]}(x);
  return {
      Seen::Beacon{number, y + Eigen::Vector2d(0.05 * random.normal(), 0.02 * random.normal())}};
}

/// One second of driving at 50 Hz; the measurements are given in the order of `key`.
template <class Key>
Filter run(const std::vector<Timed>& measurements, Key key) {
  std::vector<Timed> sorted = measurements;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](const Timed& a, const Timed& b) { return key(a) < key(b); });
  DelayedFilter<Filter, Seen, 200> filter(made(), 0.0);
  std::size_t next = 0;
  const auto give_until = [&](double now) {
    for (; next < sorted.size() && key(sorted[next]) <= now; ++next) {
      const auto outcome = filter.measure(sorted[next].time, sorted[next].seen);
      ASSERT_EQ(outcome.status, DelayStatus::taken);
      ASSERT_EQ(outcome.result, UpdateStatus::updated);
    }
  };
  for (int k = 1; k <= 50; ++k) {
    const double now = 0.02 * k;
    EXPECT_EQ(filter.advance(now, Eigen::Vector2d(3.0 + std::sin(now), 3.0)), DelayStatus::taken);
    give_until(now);
  }
  give_until(10.0);
  return filter.filter();
}

// Late, shuffled or in time: the same estimate, since each replay is the same computation but for
// where an interval between two samples is split (the rounding of RK4 and of F P Fᵀ).
TEST(DelayedFilter, TheOrderOfArrivalDoesNotMatter) {
  Random random(81);
  std::vector<Timed> measurements;
  for (int k = 1; k <= 40; ++k) {
    const double time = 0.02 * random.uniform(0.0, 48.0);
    measurements.push_back(
        {time, time + 0.02 * std::floor(random.uniform(1.0, 20.0)), seen_at(random, k)});
  }
  // Two of one time stamp.
  measurements[7].time = measurements[6].time;
  measurements[7].arrival = measurements[6].arrival;
  const Filter in_time = run(measurements, [](const Timed& m) { return m.time + 0.02; });
  const Filter late = run(measurements, [](const Timed& m) { return m.arrival; });
  const Filter at_the_end = run(measurements, [](const Timed&) { return 5.0; });
  for (const Filter* other : {&late, &at_the_end}) {
    EXPECT_LT((other->x_hat() - in_time.x_hat()).norm(), 1e-12);
    EXPECT_LT((other->P() - in_time.P()).norm(), 1e-12 * in_time.P().norm());
  }
  EXPECT_LT(in_time.P()(0, 0), 0.01);
}

TEST(DelayedFilter, SaysWhatItCannotTake) {
  DelayedFilter<Filter, Seen, 10> filter(made(), 1.0);
  Random random(82);
  const Seen seen = seen_at(random, 3);
  const Eigen::Vector2d u(1.0, 1.0);
  // Before the first prediction, at its time.
  EXPECT_EQ(filter.measure(1.0, seen).status, DelayStatus::taken);
  EXPECT_EQ(filter.measure(0.9, seen).status, DelayStatus::too_old);
  EXPECT_EQ(filter.measure(1.1, seen).status, DelayStatus::in_the_future);
  EXPECT_EQ(filter.measure(std::nan(""), seen).status, DelayStatus::not_finite);
  const Vector5 x_hat = filter.filter().x_hat();
  EXPECT_EQ(filter.advance(0.5, u), DelayStatus::in_the_past);
  EXPECT_EQ(filter.advance(HUGE_VAL, u), DelayStatus::not_finite);
  EXPECT_EQ(filter.filter().x_hat(), x_hat);
  for (int k = 1; k <= 20; ++k) {
    EXPECT_EQ(filter.advance(1.0 + 0.02 * k, u), DelayStatus::taken);
  }
  // Ten samples are kept, the oldest of them at 1.22.
  EXPECT_NEAR(filter.oldest(), 1.22, 1e-12);
  EXPECT_EQ(filter.measure(1.21, seen).status, DelayStatus::too_old);
  const auto oldest = filter.measure(1.23, seen);
  EXPECT_EQ(oldest.status, DelayStatus::taken);
  EXPECT_EQ(oldest.replayed, 9u);
  // It took the oldest one's place.
  EXPECT_EQ(filter.oldest(), 1.23);
  EXPECT_EQ(filter.measure(1.4, seen).replayed, 0u);
  EXPECT_NEAR(filter.now(), 1.4, 1e-12);
  filter.reset(made().estimate(), 7.0);
  EXPECT_EQ(filter.oldest(), 7.0);
  EXPECT_EQ(filter.measure(1.4, seen).status, DelayStatus::too_old);
}

using Guarded = GuardedFilter<Filter>;

/// A beacon through the filter's guard.
struct GuardedBeacon {
  std::size_t number = 0;
  Eigen::Vector2d y{};

  UpdateStatus operator()(Guarded& guarded) const noexcept {
    return guarded.filter()
        .correct(y, test::Sighting{test::beacons[number]}, test::sighting_noise(),
                 {.guard = guarded.guard()}, AngleDifference<1>{})
        .status;
  }
};

// The guard doubts the estimate after three in a row that do not fit: two of them, one that fits
// and a third, the fitting one late. Replays that counted again would make four of the three.
TEST(DelayedFilter, AGuardCountsReplaysOnce) {
  const auto guard = OutlierGuard::create({.recover_after = 3, .recover_time = Time(0.3)}).value();
  Vector5 x = Vector5::Zero();
  const auto seen = [&](std::size_t number, double off) {
    return GuardedBeacon{number,
                         test::Sighting{test::beacons[number]}(x) + Eigen::Vector2d(off, 0.0)};
  };
  struct Look {
    double time;
    GuardedBeacon beacon;
  };
  const std::vector<Look> looks{{0.05, seen(0, 0.0)}, {0.11, seen(1, 9.0)}, {0.15, seen(2, 9.0)},
                                {0.19, seen(3, 0.0)}, {0.25, seen(0, 9.0)}, {0.31, seen(1, 9.0)}};
  const auto run = [&](const std::vector<std::size_t>& order, double until, bool at_once) {
    DelayedFilter<Guarded, GuardedBeacon, 100> filter(Guarded(made(), {guard}), 0.0);
    std::size_t next = 0;
    for (int k = 1; k <= 50 && 0.02 * k <= until + 1e-9; ++k) {
      filter.advance(0.02 * k, Eigen::Vector2d::Zero());
      while (at_once && next < order.size() && looks[order[next]].time <= 0.02 * k) {
        filter.measure(looks[order[next]].time, looks[order[next]].beacon);
        ++next;
      }
    }
    for (; next < order.size(); ++next) {
      filter.measure(looks[order[next]].time, looks[order[next]].beacon);
    }
    return filter.filter();
  };
  const Guarded in_time = run({0, 1, 2, 3, 4, 5}, 0.4, true);
  EXPECT_EQ(in_time.guard().rejected_in_a_row(), 2);
  EXPECT_FALSE(in_time.guard().memory().doubting);
  EXPECT_NEAR(in_time.guard().memory().since_fit, 0.21, 1e-12);
  for (const std::vector<std::size_t>& order :
       {std::vector<std::size_t>{0, 1, 2, 4, 5, 3}, {5, 4, 3, 2, 1, 0}, {3, 0, 5, 1, 4, 2}}) {
    const Guarded late = run(order, 0.4, false);
    EXPECT_EQ(late.guard().rejected_in_a_row(), 2);
    EXPECT_FALSE(late.guard().memory().doubting);
    EXPECT_NEAR(late.guard().memory().since_fit, 0.21, 1e-12);
    EXPECT_LT((late.filter().x_hat() - in_time.filter().x_hat()).norm(), 1e-12);
    EXPECT_LT((late.filter().P() - in_time.filter().P()).norm(),
              1e-12 * in_time.filter().P().norm());
  }
}

TEST(DelayedFilter, AllocatesNothing) {
  if (!test::counts_allocations()) {
    GTEST_SKIP() << "a sanitizer has its own allocator";
  }
  DelayedFilter<Filter, Seen, 50> filter(made(), 0.0);
  Random random(83);
  const Seen seen = seen_at(random, 3);
  const test::AllocationCounter counter;
  for (int k = 1; k < 200; ++k) {
    filter.advance(0.02 * k, Eigen::Vector2d(1.0, 1.0));
    filter.measure(0.02 * k - 0.5, seen);
  }
  EXPECT_EQ(counter.count(), 0u);
}

}  // namespace
}  // namespace flyball::delayed_filter_test
