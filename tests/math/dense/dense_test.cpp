#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "math/dense/dense.hpp"
#include "math/dense/dense_reduction.hpp"
#include "math/dense/ordinary_units.hpp"
#include "math/dense/spectral_norm.hpp"
#include "support/random_systems.hpp"

namespace flyball::dense_test {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using test::random_matrix;

// Entries near the ends of the doubles' range, whose squares have no double: what is found is that
// of ordinary entries, in their unit.
TEST(Dense, DecomposesInAnyUnit) {
  Random random(41);
  for (const Eigen::Index n : {1, 2, 5, 12}) {
    for (const int unit : {-900, -600, 0, 600, 900}) {
      SCOPED_TRACE(testing::Message() << n << " x " << n << " in units of 2^" << unit);
      const MatrixXd A = random_matrix(random, n, n);
      const MatrixXd S = A + A.transpose();
      const MatrixXcd C = A.cast<std::complex<double>>() + std::complex<double>(0.0, 1.0) * S;
      const MatrixXd B = random_matrix(random, n, 2);
      const MatrixXd A_unit = detail::times_power(A, unit);
      const MatrixXd S_unit = detail::times_power(S, unit);
      const MatrixXcd C_unit = detail::times_power(C, unit);
      const auto same = [](const auto& found, int power, const auto& expected) {
        EXPECT_LE((detail::times_power(found, -power) - expected).norm(), 1e-11 * expected.norm());
      };
      same(detail::eigenvalues_of(A_unit), unit, detail::eigenvalues_of(A));
      same(detail::eigenvalues_of_complex(C_unit), unit, detail::eigenvalues_of_complex(C));
      same(detail::symmetric_eigensystem_of(S_unit).values, unit,
           detail::symmetric_eigensystem_of(S).values);
      const auto system = detail::eigensystem_of(A_unit);
      same(system.values, unit, detail::eigensystem_of(A).values);
      same(MatrixXcd(system.vectors * detail::times_power(system.values, -unit).asDiagonal()), 0,
           MatrixXcd(A * system.vectors));

      const auto schur = detail::complex_schur_of(A_unit);
      EXPECT_TRUE(schur.converged);
      same(MatrixXcd(schur.U * schur.T * schur.U.adjoint()), unit,
           MatrixXcd(A.cast<std::complex<double>>()));
      const auto qr = detail::full_qr(A_unit);
      same(MatrixXd(qr.Q * qr.R), unit, A);
      same(MatrixXd(detail::pivoted_qr(A_unit).R), unit, MatrixXd(detail::pivoted_qr(A).R));
      same(detail::triangle_of(A_unit), unit, detail::triangle_of(A));
      const auto hessenberg = detail::hessenberg_of(A_unit);
      same(MatrixXd(hessenberg.Q * hessenberg.H * hessenberg.Q.transpose()), unit, A);

      double rcond = 0.0;
      double rcond_unit = 0.0;
      same(detail::solve_linear(A_unit, B, &rcond_unit), -unit, detail::solve_linear(A, B, &rcond));
      EXPECT_NEAR(rcond_unit, rcond, 1e-12);
      EXPECT_GT(rcond, 0.0);
      const MatrixXcd B_complex = B.cast<std::complex<double>>();
      same(detail::solve_complex(C_unit, B_complex, &rcond_unit), -unit,
           detail::solve_complex(C, B_complex, &rcond));
      EXPECT_NEAR(rcond_unit, rcond, 1e-12);
      same(detail::solve_least_squares(A_unit, B), -unit, detail::solve_least_squares(A, B));
    }
  }
}

TEST(Dense, SpectralNormIsTheLargestSingularValue) {
  Random random(43);
  for (const auto& [rows, columns] : {std::pair{1, 1}, {1, 6}, {6, 1}, {3, 3}, {8, 8}, {4, 7}}) {
    for (const int unit : {-1000, -600, 0, 600, 900}) {
      const MatrixXcd C = random_matrix(random, rows, columns) +
                          std::complex<double>(0.0, 1.0) * random_matrix(random, rows, columns);
      const double expected = detail::singular_values_of_complex(C)(0);
      const double found = detail::spectral_norm_of_complex(detail::times_power(C, unit));
      EXPECT_NEAR(std::ldexp(found, -unit) / expected, 1.0, 1e-14) << rows << " x " << columns;
    }
  }
  EXPECT_EQ(detail::spectral_norm_of_complex(MatrixXcd::Zero(2, 3)), 0.0);
  EXPECT_EQ(detail::spectral_norm_of_complex(MatrixXcd(0, 3)), 0.0);
  EXPECT_TRUE(std::isnan(detail::spectral_norm_of_complex(MatrixXcd::Constant(2, 2, NAN))));
}

}  // namespace
}  // namespace flyball::dense_test
