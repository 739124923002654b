// Chapter 5 in code: operators on matrices, definiteness, the Riccati and Lyapunov equations with
// what they leave, and a gradient by Theorem 5.12.1.
#include <algorithm>
#include <cstdio>
#include <string>

#include <Eigen/Core>

#include <flyball/math/dense/linear_algebra.hpp>
#include <flyball/math/derivatives/differentiation.hpp>
#include <flyball/math/equations/matrix_equation.hpp>
#include <flyball/math/riccati/riccati.hpp>

int main() {
  using namespace flyball;
  using Eigen::Matrix2d;
  using Eigen::Vector2d;

  //! [operators]
  const Eigen::Matrix<double, 3, 2> tall{{1.0, 0.0}, {1.0, 1.0}, {1.0, 2.0}};
  const Eigen::Vector3d heights(1.0, 3.0, 5.0);
  const Vector2d line = pseudoinverse(tall)->X * heights;  // least squares: 1 + 2 x
  const Matrix2d weights = Vector2d(0.02, 0.4).array().square().inverse().matrix().asDiagonal();
  const Eigen::MatrixXd both = block_diagonal({weights, Matrix2d::Identity()});
  std::printf("line %.3f + %.3f x, trace %.2f\n", line(0), line(1), both.trace());
  //! [operators]

  //! [definiteness]
  const Matrix2d M{{2.0, 3.0}, {3.0, 2.0}};
  const auto test = test_definiteness(M).value();
  std::printf("eigenvalues %.0f and %.0f: %s\n", test.eigenvalues(0), test.eigenvalues(1),
              std::string(to_string(test.definiteness)).c_str());
  //! [definiteness]

  //! [equations]
  const Matrix2d A{{0.0, 1.0}, {-2.0, -3.0}};
  const Vector2d B(0.0, 1.0);
  const Matrix2d Q = Matrix2d::Identity();
  const Eigen::Matrix<double, 1, 1> R(1.0);
  const auto continuous = care(A, B, Q, R).value();                           // (5.1)
  const auto discrete = dare(A, B, Q, R).value();                             // (5.2)
  const auto gramian = lyapunov(A, Q).value();                                // (5.3)
  const auto sum = discrete_lyapunov(0.5 * Matrix2d::Identity(), Q).value();  // (5.4)
  //! [equations]
  for (const auto& [name, residual] :
       {std::pair{"CARE", continuous.residual}, std::pair{"DARE", discrete.residual},
        std::pair{"Lyapunov", gramian.residual}, std::pair{"discrete Lyapunov", sum.residual}}) {
    std::printf("%-18s solved to %.0e\n", name, residual);
  }

  //! [gradient]
  const Vector2d x(1.0, -2.0);
  const Vector2d slope = gradient([&](const auto& v) { return v.dot(M * v); }, x);
  const Vector2d theorem = 2.0 * M * x;  // 5.12.1, M symmetric
  //! [gradient]
  std::printf("gradient (%.0f, %.0f), by the theorem (%.0f, %.0f)\n", slope(0), slope(1),
              theorem(0), theorem(1));
  const double worst =
      std::max({continuous.residual, discrete.residual, gramian.residual, sum.residual});
  return worst < 1e-12 && (line - Vector2d(1.0, 2.0)).norm() < 1e-12 &&
                 (slope - theorem).norm() < 1e-12
             ? 0
             : 1;
}
