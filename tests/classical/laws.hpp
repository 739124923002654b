#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <string>
#include <vector>

#include <flyball/classical/delay_margins.hpp>
#include <flyball/classical/nyquist.hpp>
#include <flyball/classical/partial_fractions.hpp>
#include <flyball/classical/response_margins.hpp>
#include <flyball/classical/transfer_matrix.hpp>
#include <flyball/core/random.hpp>

#include "math/dense/dense.hpp"

/// What holds for every linear system, on made-up ones: a sample of it is a test, ten thousand of
/// each a campaign (bench/classical).
namespace flyball::test {

using Complex = std::complex<double>;
using classical::TransferFunction;

/// How a law did.
struct LawTally {
  std::string law;
  double allowed = 0.0;  ///< Of `worst`.
  int systems = 0;       ///< On which it was tried.
  int refused = 0;       ///< That had no answer.
  int violations = 0;
  double worst = 0.0;

  void see(double error) {
    ++systems;
    violations += error <= allowed ? 0 : 1;
    worst = std::max(worst, std::isnan(error) ? HUGE_VAL : error);
  }
};

/// Roots between 0.1 and 10 rad/s, in pairs or real, some unstable where they may be.
inline Eigen::VectorXcd random_roots(Random& random, Eigen::Index count, double unstable) {
  Eigen::VectorXcd roots(count);
  for (Eigen::Index k = 0; k < count;) {
    const double size = std::pow(10.0, 2.0 * random.uniform() - 1.0);
    const double side = random.uniform() < unstable ? 1.0 : -1.0;
    if (k + 1 < count && random.uniform() < 0.6) {
      const double angle = 0.05 + 1.45 * random.uniform();
      roots(k) = size * Complex(side * std::cos(angle), std::sin(angle));
      roots(k + 1) = std::conj(roots(k));
      k += 2;
    } else {
      roots(k++) = side * size;
    }
  }
  return roots;
}

/// @param zeros  Fewer than poles. @param unstable  The share of poles on the right.
inline TransferFunction random_transfer(Random& random, double unstable, double delay = 0.0) {
  const auto poles = static_cast<Eigen::Index>(1 + random.bits() % 6);
  const auto zeros = static_cast<Eigen::Index>(random.bits() % static_cast<std::uint64_t>(poles));
  const double gain = std::pow(10.0, 2.0 * random.uniform() - 0.7);
  return TransferFunction::from_zeros(random_roots(random, zeros, 0.3),
                                      random_roots(random, poles, unstable), gain, std::nullopt,
                                      Time(delay))
      .value();
}

inline Complex random_point(Random& random) {
  return {random.normal(), 3.0 * random.normal()};
}

/// C(sI - A)⁻¹B + D against zeros, poles and gain of the channel, relative to the larger of |G| and
/// the smallest change that a perturbation of A by rounding makes (|G'| ε‖A‖).
inline LawTally states_and_factors(std::uint64_t seed, int count) {
  LawTally law{"C(sI-A)^-1 B + D against zeros, poles, gain", 1e-9};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const auto n = static_cast<Eigen::Index>(1 + random.bits() % 8);
    const auto draw = [&](Eigen::Index rows, Eigen::Index columns) {
      return Eigen::MatrixXd(
          Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); }));
    };
    const ContinuousSystem<> system{draw(n, n), draw(n, 1), draw(1, n), draw(1, 1)};
    const auto channel = classical::channel_of(system);
    const auto response = classical::frequency_response(system);
    if (!channel || !response) {
      ++law.refused;
      continue;
    }
    double error = 0.0;
    for (const double w : {0.01, 0.3, 2.0, 50.0}) {
      const Complex G = response->at(w)(0, 0);
      const Complex nearby = response->at(w * (1.0 + 1e-7))(0, 0);
      const double size = std::max(std::abs(G), std::abs(nearby - G));
      error = std::max(error, std::abs(channel->response(w) - G) / size);
    }
    law.see(error);
  }
  return law;
}

/// Series, sum and loop of two, both signs, at points of the plane (appendix A).
inline LawTally diagrams(std::uint64_t seed, int count) {
  LawTally law{"block diagram identities", 1e-9};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const TransferFunction G = random_transfer(random, 0.3);
    const TransferFunction H = random_transfer(random, 0.3);
    const Complex s = random_point(random);
    const auto g = G.at(s);
    const auto h = H.at(s);
    const auto loop = classical::feedback(G, H);
    const auto positive = classical::feedback(G, H, false);
    if (!g || !h || !loop || !positive) {
      ++law.refused;
      continue;
    }
    const auto off = [&](const Expected<TransferFunction>& made, Complex expected, double size) {
      const auto value = made.value().at(s);
      return value ? std::abs(*value - expected) / size : HUGE_VAL;
    };
    const double below = std::abs(1.0 + *g * *h);
    const double above = std::abs(1.0 - *g * *h);
    const double cross = 1.0 + std::abs(*g * *h);
    law.see(std::max({off(classical::series(G, H), *g * *h, std::abs(*g * *h)),
                      off(classical::parallel(G, H), *g + *h, std::abs(*g) + std::abs(*h)),
                      off(loop, *g / (1.0 + *g * *h), std::abs(*g) / below * cross / below),
                      off(positive, *g / (1.0 - *g * *h), std::abs(*g) / above * cross / above)}));
  }
  return law;
}

/// Residues sum to the function, relative to their sizes.
inline LawTally residues(std::uint64_t seed, int count) {
  LawTally law{"residues sum to the function", 1e-10};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const TransferFunction G = random_transfer(random, 0.3);
    const auto found = classical::partial_fractions(G.num(), G.den());
    const Complex s = random_point(random);
    const auto value = G.at(s);
    if (!found || !value) {
      ++law.refused;
      continue;
    }
    double size = std::abs(*value);
    for (const classical::PartialFraction& fraction : found->fractions) {
      Complex power = 1.0;
      for (const Complex& residue : fraction.residues) {
        power *= s - fraction.pole;
        size += std::abs(residue / power);
      }
    }
    law.see(std::abs(found->at(s) - *value) / size);
  }
  return law;
}

/// The Nyquist count is that of the closed loop's unstable poles; zero or one.
inline LawTally nyquist_counts(std::uint64_t seed, int count) {
  LawTally law{"Nyquist count = unstable closed-loop poles", 0.0};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const TransferFunction L = random_transfer(random, 0.25);
    const auto response = classical::frequency_response(L);
    const auto closed = classical::unity_feedback(L);
    const auto poles = closed.and_then([](const TransferFunction& T) { return T.poles(); });
    const auto curve = response.and_then(
        [](const classical::FrequencyResponse& r) { return classical::nyquist(r); });
    if (!curve || !poles || !curve->closed_loop_unstable ||
        poles->real().cwiseAbs().minCoeff() < 1e-9) {
      ++law.refused;
      continue;
    }
    const auto unstable = (poles->real().array() > 0.0).count();
    law.see(*curve->closed_loop_unstable == unstable ? 0.0 : 1.0);
  }
  return law;
}

/// Zeros and poles of order 20 through states and back, as the function that they make: against the
/// larger of 1e-9 and a hundred times what an error of rounding of the size of A, B and C does to
/// it, their own condition.
inline LawTally there_and_back(std::uint64_t seed, int count) {
  LawTally law{"zeros and poles of order 20 through states", 1.0};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const auto zpk = classical::ZeroPoleGain::create(random_roots(random, 14, 0.3),
                                                     random_roots(random, 20, 0.0), 1.0)
                         .value();
    const auto system = zpk.to_state_space();
    const auto back =
        system.and_then([](const ContinuousSystem<>& s) { return classical::channel_of(s); });
    if (!back || back->poles().size() != 20 || back->zeros().size() != 14) {
      ++law.refused;
      continue;
    }
    const auto off = [&](const ContinuousSystem<>& s, double w) {
      const Eigen::MatrixXcd shifted =
          Complex(0.0, w) * Eigen::MatrixXcd::Identity(20, 20) - s.A.cast<Complex>();
      const Eigen::VectorXcd x =
          flyball::detail::solve_complex(shifted, Eigen::MatrixXcd(s.B.cast<Complex>()));
      const Complex G = (s.C.cast<Complex>() * x)(0) + s.D(0, 0);
      return std::abs(G / zpk.response(w) - 1.0);
    };
    ContinuousSystem<> blurred = *system;
    for (Eigen::MatrixXd* M : {&blurred.A, &blurred.B, &blurred.C}) {
      const double size = 1.1e-16 * M->norm();
      for (double& entry : M->reshaped()) {
        entry += size * random.normal();
      }
    }
    double error = 0.0;
    for (const double w : {0.05, 0.7, 3.0, 30.0}) {
      const double own = std::abs(back->response(w) / zpk.response(w) - 1.0);
      error = std::max(error, own / std::max(1e-9, 100.0 * off(blurred, w)));
    }
    law.see(error);
  }
  return law;
}

/// Each crossing is one, to 1e-10, and two independent searches find the same: polynomials in ω²
/// in 31 digits, and bounds on how far ln L moves. @param delay  Whether there is dead time.
inline LawTally margins(std::uint64_t seed, int count, bool delay) {
  LawTally law{delay ? "crossings with dead time, found by both" : "crossings, found by both",
               1e-10};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const double late = delay ? 0.02 + random.uniform() : 0.0;
    const TransferFunction L = random_transfer(random, 0.2, late);
    const auto one = classical::loop_margins(L);
    const auto other = classical::frequency_response(L).and_then(
        [](const classical::FrequencyResponse& r) { return classical::loop_margins(r); });
    if (!one || !other) {
      ++law.refused;
      continue;
    }
    double error = one->gain_crossings.size() == other->gain_crossings.size() ? 0.0 : 1.0;
    const std::size_t phases = std::min(one->phase_crossings.size(), other->phase_crossings.size());
    if (!delay && one->phase_crossings.size() != other->phase_crossings.size()) {
      error = 1.0;
    }
    for (std::size_t k = 0; k < phases; ++k) {
      const auto& at = one->phase_crossings[k];
      error = std::max({error, std::abs(std::arg(-L.response(at.frequency))),
                        std::abs(at.frequency / other->phase_crossings[k].frequency - 1.0)});
    }
    for (const auto& at : one->gain_crossings) {
      error = std::max(error, std::abs(std::abs(L.response(at.frequency)) - 1.0));
    }
    error = std::max(error, one->stable == other->stable ? 0.0 : 1.0);
    law.see(error);
  }
  return law;
}

/// Loops with dead time in them: crossings are crossings, as many as a third search sees, by
/// changes of sign on a grid.
inline LawTally delayed_margins(std::uint64_t seed, int count) {
  LawTally law{"crossings of loops with dead time inside", 1e-10};
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const auto G = classical::DelaySystem::create(random_transfer(random, 0.0, random.uniform()));
    const auto H = classical::DelaySystem::create(random_transfer(random, 0.0, random.uniform()));
    const auto inner =
        G.and_then([&](const classical::DelaySystem& g) { return classical::parallel(g, *H); });
    const auto found =
        inner.and_then([](const classical::DelaySystem& L) { return classical::loop_margins(L); });
    if (!found) {
      ++law.refused;
      continue;
    }
    const auto L = [&](double w) { return inner->response(w)(0, 0); };
    double error = 0.0;
    for (const auto& at : found->gain_crossings) {
      error = std::max(error, std::abs(std::abs(L(at.frequency)) - 1.0));
    }
    int changes = 0;
    bool above = std::abs(L(1e-4)) > 1.0;
    for (double w = 1e-4; w < 1e3; w *= 1.004) {
      const bool now = std::abs(L(w)) > 1.0;
      changes += now != above ? 1 : 0;
      above = now;
    }
    // A grid may miss pairs, never see one that is not there.
    law.see(changes > static_cast<int>(found->gain_crossings.size()) ? 1.0 : error);
  }
  return law;
}

/// A law on systems of a seed.
using Law = LawTally (*)(std::uint64_t seed, int count);
/// The last, of systems with dead time inside, is tried on a tenth of the count.
inline constexpr Law all_laws[] = {
    &states_and_factors,
    &diagrams,
    &residues,
    &nyquist_counts,
    &there_and_back,
    [](std::uint64_t seed, int count) { return margins(seed, count, false); },
    [](std::uint64_t seed, int count) { return margins(seed, count, true); },
    [](std::uint64_t seed, int count) { return delayed_margins(seed, std::max(1, count / 10)); }};

}  // namespace flyball::test
