#include <flyball/systems/model_reduction.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <flyball/systems/interconnection.hpp>
#include <flyball/systems/norms.hpp>

#include "support/oracle.hpp"
#include "systems/random_systems.hpp"

namespace flyball::model_reduction_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// A random system of some unstable poles, none near the border.
ContinuousSystem<> mixed_system(Random& random, bool discrete) {
  for (;;) {
    const auto n = static_cast<Index>(2 + random.bits() % 9);
    auto s = test::random_system(random, n, 1 + static_cast<Index>(random.bits() % 2),
                                 1 + static_cast<Index>(random.bits() % 2));
    if (discrete) {
      s.A /= 0.8 * std::sqrt(static_cast<double>(n));
    }
    bool far = true;
    for (const auto& pole : test::eigenvalues(s.A)) {
      far = far && std::abs(discrete ? std::abs(pole) - 1.0 : pole.real()) > 0.02;
    }
    if (far) {
      return s;
    }
  }
}

// The two parts add up to the system, each with its own poles; the error of every order is within
// the bound, as is |G - G_r| at frequencies, and matched models have the gain at rest.
TEST(ModelReduction, SplitsAndBounds) {
  Random random(61);
  int unstable = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const bool discrete = trial % 2 == 1;
    const auto s = mixed_system(random, discrete);
    const DiscreteSystem<> d{s.A, s.B, s.C, s.D, Time(0.1)};
    const std::complex<double> point(0.3, 1.7);
    SpectralSplit<ContinuousSystem<>> parts;
    if (discrete) {
      const auto two = split_spectrum(d).value();
      parts = {{two.stable.A, two.stable.B, two.stable.C, two.stable.D},
               {two.unstable.A, two.unstable.B, two.unstable.C, two.unstable.D},
               two.T,
               two.residual};
    } else {
      parts = split_spectrum(s).value();
    }
    const Eigen::MatrixXcd whole = test::response(s, point);
    Eigen::MatrixXcd sum = parts.stable.A.rows() > 0 ? test::response(parts.stable, point)
                                                     : Eigen::MatrixXcd(parts.stable.D);
    if (parts.unstable.A.rows() > 0) {
      ++unstable;
      sum += test::response(parts.unstable, point);
      for (const auto& pole : test::eigenvalues(parts.unstable.A)) {
        EXPECT_GT(discrete ? std::abs(pole) - 1.0 : pole.real(), 0.0);
      }
    }
    EXPECT_LE((sum - whole).norm(), 1e-9 * (1.0 + whole.norm())) << trial;
    const Index r = parts.unstable.A.rows();
    for (Index order = r; order < s.A.rows(); ++order) {
      for (const auto method : {ReductionMethod::truncation, ReductionMethod::matched}) {
        const auto check = [&](const auto& reduced, const auto& given) {
          EXPECT_LE(reduced.error, reduced.error_bound * (1.0 + 1e-8) + 1e-9) << trial;
          EXPECT_EQ(reduced.unstable, r);
          EXPECT_EQ(reduced.system.A.rows(), order);
          for (const double w : {0.0, 0.1, 1.0, 3.0}) {
            const std::complex<double> at =
                discrete ? std::polar(1.0, w) : std::complex<double>(0.0, w);
            const Eigen::MatrixXcd G_r =
                order > 0 ? test::response(reduced.system, at) : Eigen::MatrixXcd(reduced.system.D);
            const Eigen::MatrixXcd off = test::response(given, at) - G_r;
            // Frobenius' norm of at most 2 x 2 is within √2.
            EXPECT_LE(off.norm(), 1.4143 * reduced.error_bound + 1e-8);
            if (w == 0.0 && method == ReductionMethod::matched) {
              EXPECT_LE(off.norm(), 1e-8 * (1.0 + G_r.norm()));
            }
          }
        };
        if (discrete) {
          check(reduce_model(d, order, method).value(), d);
        } else {
          check(reduce_model(s, order, method).value(), s);
        }
      }
    }
  }
  EXPECT_GE(unstable, 50);
}

// All states are kept by the coprime factors, too: the system itself; fewer stay within the bound
// of the factors.
TEST(ModelReduction, CoprimeFactors) {
  Random random(62);
  for (int trial = 0; trial < 30; ++trial) {
    const auto s = mixed_system(random, trial % 2 == 1);
    const DiscreteSystem<> d{s.A, s.B, s.C, s.D, Time(0.1)};
    const std::complex<double> point(0.3, 1.7);
    const auto check = [&](const auto& given) {
      const auto all = reduce_model(given, s.A.rows(), ReductionMethod::coprime);
      ASSERT_TRUE(all) << to_string(all.error());
      const Eigen::MatrixXcd whole = test::response(s, point);
      EXPECT_LE((test::response(all->system, point) - whole).norm(), 1e-6 * (1.0 + whole.norm()));
      EXPECT_LT(all->hankel.maxCoeff(), 1.0);
      const auto one = reduce_model(given, 1, ReductionMethod::coprime).value();
      EXPECT_EQ(one.system.A.rows(), 1);
      EXPECT_LE(one.error, one.error_bound * (1.0 + 1e-8));
    };
    if (trial % 2 == 1) {
      check(d);
    } else {
      check(s);
    }
  }
}

TEST(ModelReduction, Errors) {
  MatrixXd A(3, 3);
  A << -1.0, 0.0, 0.0, 0.0, -2.0, 1.0, 0.0, 0.0, 3.0;
  const ContinuousSystem<> s{A, MatrixXd::Ones(3, 1), MatrixXd::Ones(1, 3), MatrixXd::Zero(1, 1)};
  const auto few = reduce_model(s, 0);
  ASSERT_FALSE(few);
  EXPECT_TRUE(few.error().is(ArgumentError::out_of_range));
  EXPECT_EQ(to_string(few.error()),
            "reduce_model: the order is 0; it must be from 1 to 3: the unstable states, and those "
            "that are reached and seen");
  EXPECT_TRUE(reduce_model(s, 4).error().is(ArgumentError::out_of_range));
  ContinuousSystem<> integrator = s;
  integrator.A(2, 2) = 0.0;
  EXPECT_TRUE(split_spectrum(integrator).error().is(SystemError::not_stable));
  integrator.A(0, 0) = NAN;
  EXPECT_TRUE(split_spectrum(integrator).error().is(ArgumentError::not_finite));
}

}  // namespace
}  // namespace flyball::model_reduction_test
