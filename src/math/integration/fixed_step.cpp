#include <flyball/math/integration/fixed_step.hpp>

#include <flyball/math/exponential/matrix_exponential.hpp>

#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Expected<void> check_linear(const MatrixRef& A, const MatrixRef& B, const MatrixRef& x,
                            const MatrixRef& u, const MatrixRef& u_next, double dt) {
  constexpr std::string_view where = "integrate_linear";
  FLYBALL_CHECK(check_square(A, where, "A"));
  return Checks(where)
      .shape(B, A.rows(), B.cols(), "B", "states x inputs")
      .shape(x, A.rows(), 1, "x", "states x 1")
      .shape(u, B.cols(), 1, "u", "inputs x 1")
      .shape(u_next, B.cols(), 1, "u_next", "inputs x 1")
      .finite(A, "A")
      .finite(B, "B")
      .finite(x, "x")
      .finite(u, "u")
      .finite(u_next, "u_next")
      .finite(dt, "dt");
}

}  // namespace

Expected<VectorXd> integrate_linear(const MatrixRef& A, const MatrixRef& B, const MatrixRef& x,
                                    const MatrixRef& u, double dt) {
  FLYBALL_CHECK(check_linear(A, B, x, u, u, dt));
  const Index n = A.rows();
  // d[x; 1]/dt = [A Bu; 0 0][x; 1]
  MatrixXd M = MatrixXd::Zero(n + 1, n + 1);
  M.topLeftCorner(n, n) = A * dt;
  M.topRightCorner(n, 1) = detail::product(B, u) * dt;
  return expm(M).map([&](const MatrixXd& E) {
    return VectorXd(detail::product(E.topLeftCorner(n, n), x) + E.topRightCorner(n, 1));
  });
}

Expected<VectorXd> integrate_linear(const MatrixRef& A, const MatrixRef& B, const MatrixRef& x,
                                    const MatrixRef& u, const MatrixRef& u_next, double dt) {
  FLYBALL_CHECK(check_linear(A, B, x, u, u_next, dt));
  const Index n = A.rows();
  // d[x; s; 1]/dt with s = t/dt: [A B(u_next - u) Bu; 0 0 1/dt; 0 0 0]
  MatrixXd M = MatrixXd::Zero(n + 2, n + 2);
  M.topLeftCorner(n, n) = A * dt;
  M.block(0, n, n, 1) = detail::product(B, u_next - u) * dt;
  M.block(0, n + 1, n, 1) = detail::product(B, u) * dt;
  M(n, n + 1) = 1.0;
  return expm(M).map([&](const MatrixXd& E) {
    return VectorXd(detail::product(E.topLeftCorner(n, n), x) + E.block(0, n + 1, n, 1));
  });
}

}  // namespace flyball
