#pragma once

#include <cmath>
#include <optional>
#include <random>

#include <flyball/control/certificate.hpp>
#include <flyball/control/lqr.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/systems/discretize.hpp>

/// Sampled loops of plants that are not known well, some stable for all of them and some not.
namespace bench {

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}

/// A controller for the plant in the middle of the set, by LQR and a Kalman filter.
inline std::optional<flyball::PlantInputLoop> regulated(const Eigen::MatrixXd& A,
                                                        const Eigen::MatrixXd& B,
                                                        const Eigen::MatrixXd& C, double period,
                                                        Random& random) {
  const Eigen::Index n = A.rows();
  const flyball::ContinuousSystem<> plant{A, B, C, Eigen::MatrixXd::Zero(C.rows(), 1)};
  const auto model = flyball::discretize(plant, flyball::Time(period));
  if (!model) {
    return std::nullopt;
  }
  std::vector<double> tolerances, noise;
  for (Eigen::Index i = 0; i < n; ++i) {
    tolerances.push_back(std::pow(10.0, uniform(random, -1.5, 0.5)));
    noise.push_back(std::pow(10.0, uniform(random, -2.0, 0.0)));
  }
  const auto regulator = flyball::lqr(*model, flyball::bryson(tolerances),
                                      flyball::bryson({uniform(random, 0.3, 3.0)}));
  const auto filter = flyball::kalman_gain(
      *model, flyball::standard_deviations(noise),
      flyball::standard_deviations(std::vector<double>(static_cast<std::size_t>(C.rows()), 0.1)));
  if (!regulator || !filter) {
    return std::nullopt;
  }
  auto loop = flyball::observer_regulator_loop(A, B, C, *model, regulator->K, filter->K,
                                               flyball::Time(0.0));
  return loop ? std::optional(*std::move(loop)) : std::nullopt;
}

/// A plant of one to three states with one to three uncertain entries, a gain and, half of the
/// time, a delay that are uncertain too.
inline flyball::UncertainLoop random_loop(Random& random) {
  while (true) {
    const auto n = static_cast<Eigen::Index>(1 + random() % 3);
    Eigen::MatrixXd A(n, n);
    Eigen::MatrixXd B(n, 1);
    Eigen::MatrixXd C(1, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        A(i, j) = uniform(random, -2.0, 2.0) - (i == j ? 1.0 : 0.0);
      }
      B(i, 0) = uniform(random, -1.0, 1.0);
      C(0, i) = uniform(random, -1.0, 1.0);
    }
    const double period = std::pow(10.0, uniform(random, -2.0, -0.3));
    const auto designed = regulated(A, B, C, period, random);
    if (!designed) {
      continue;
    }
    flyball::LinearPlantFamily family{.A = A, .B = B, .A_p = {}, .B_p = {}, .E = {}, .E_p = {}};
    const auto parameters = static_cast<std::size_t>(1 + random() % 3);
    std::vector<double> low, high;
    for (std::size_t k = 0; k < parameters; ++k) {
      Eigen::MatrixXd A_p = Eigen::MatrixXd::Zero(n, n);
      Eigen::MatrixXd B_p = Eigen::MatrixXd::Zero(n, 1);
      const auto row = static_cast<Eigen::Index>(random()) % n;
      if (random() % 4 != 0) {
        A_p(std::abs(row), static_cast<Eigen::Index>(random() % static_cast<std::uint64_t>(n))) =
            1.0;
      } else {
        B_p(std::abs(row), 0) = 1.0;
      }
      family.A_p.push_back(A_p);
      family.B_p.push_back(B_p);
      const double reach = std::pow(10.0, uniform(random, -1.5, 0.2));
      low.push_back(-reach);
      high.push_back(reach);
    }
    const double gain = uniform(random, 0.0, 0.4);
    low.push_back(1.0 - gain);
    high.push_back(1.0 + gain);
    const double delay = random() % 2 == 0 ? 0.0 : uniform(random, 0.0, 1.5) * period;
    low.push_back(delay * 0.8);
    high.push_back(delay * 1.2);
    const auto set = flyball::parameter_box(low, high);
    flyball::UncertainLoop loop{
        family,        C,   designed->period, designed->A_c, designed->B_c, designed->C_c,
        designed->D_c, *set};
    // Loops whose own plant is not stable would be no question.
    const auto middle = flyball::loop_of(loop, set->centre);
    const auto radius =
        middle ? flyball::closed_loop_radius(*middle) : flyball::Expected<double>(2.0);
    if (radius && *radius < 0.999) {
      return loop;
    }
  }
}

}  // namespace bench
