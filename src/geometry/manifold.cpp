#include <flyball/geometry/manifold.hpp>

namespace flyball {

static_assert(Manifold<Eigen::Vector3d> && tangent_size<Eigen::Vector3d> == 3);
static_assert(Manifold<Eigen::VectorXd> && tangent_size<Eigen::VectorXd> == Eigen::Dynamic);
static_assert(!Manifold<Eigen::Matrix3d> && !Manifold<double>);

}  // namespace flyball
