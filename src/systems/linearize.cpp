#include <flyball/systems/linearize.hpp>

namespace flyball {

Expected<ContinuousSystem<>> numerical_linearize(ModelFunction f,
                                                 const Eigen::Ref<const Eigen::VectorXd>& x,
                                                 const Eigen::Ref<const Eigen::VectorXd>& u,
                                                 const DifferenceOptions& options) {
  const Eigen::Index n = x.size();
  const Eigen::Index m = u.size();
  Eigen::VectorXd point(n + m);
  point << x, u;
  const auto of_both = [&](const Eigen::Ref<const Eigen::VectorXd>& at,
                           const Eigen::Ref<Eigen::VectorXd>& dxdt) {
    f(at.head(n), at.tail(m), dxdt);
  };
  return numerical_jacobian(of_both, point, n, options).map([&](const Eigen::MatrixXd& J) {
    return ContinuousSystem<>{J.leftCols(n), J.rightCols(m), Eigen::MatrixXd::Identity(n, n),
                              Eigen::MatrixXd::Zero(n, m)};
  });
}

}  // namespace flyball
