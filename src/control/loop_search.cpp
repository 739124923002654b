#include <algorithm>
#include <cmath>

#include "control/loop_search.hpp"
#include "math/dense/dense.hpp"
#include "math/verified/contraction.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::VectorXd;

std::optional<FormMatrix> member_loop(const UncertainLoop& loop, const VectorXd& z, double disk) {
  const auto parameters = parameters_over(loop.set, {z, VectorXd::Zero(z.size())});
  const auto branches = branches_over(parameters.back(), loop.period.si());
  if (!branches || branches->empty()) {
    return std::nullopt;
  }
  return closed_loop_over(loop, parameters, branches->front(), disk, 1.0);
}

bool surely_unstable_member(const UncertainLoop& loop, const FoundMember& found) {
  const auto forms = member_loop(loop, found.z, 0.0);
  if (!forms) {
    return false;
  }
  constexpr Index most_states = 24;
  constexpr double beyond_rounding = 1e-6;
  return forms->rows() > most_states ? found.member.spectral_radius > 1.0 + beyond_rounding
                                     : surely_unstable(family_of(*forms));
}

VectorXd MemberSearch::into_set(VectorXd z) const {
  z = z.cwiseMax(-1.0).cwiseMin(1.0);
  const Index round = loop_.set.round;
  if (round > 0) {
    const double norm = z.head(round).norm();
    if (norm > 1.0) {
      z.head(round) *= (1.0 - 1e-15) / norm;
    }
  }
  return z;
}

bool MemberSearch::look_at(const VectorXd& z) {
  const auto forms = member_loop(loop_, z, 2.0);
  if (!forms) {
    return false;
  }
  const Eigen::MatrixXd M = family_of(*forms).centre;
  const Index n = M.rows() - 1;
  const auto size = static_cast<double>(n);
  work_ += 300.0 * size * size + eigenvalue_work(size);
  LoopMember member{.parameters = parameters_at(loop_.set, z)};
  const Eigen::VectorXcd poles =
      n == 0 ? Eigen::VectorXcd() : eigenvalues_of(M.topLeftCorner(n, n));
  member.spectral_radius = n == 0 ? 0.0 : poles.cwiseAbs().maxCoeff();
  if (!std::isfinite(member.spectral_radius)) {
    return false;
  }
  if (margins_ && member.spectral_radius < 1.0) {
    work_ += disk_margin_work(size);
    member.disk_margin = disk_margin_of(M, poles);
  }
  const bool slower = !found() || member.spectral_radius > slowest_.member.spectral_radius;
  const bool thinner = margins_ && (!found() || member.disk_margin < thinnest_.member.disk_margin);
  if (slower) {
    slowest_ = {z, member};
  }
  if (thinner) {
    thinnest_ = {z, member};
  }
  looked_ = true;
  return slower || thinner;
}

template <class Found>
void MemberSearch::descend(const Found& best) {
  constexpr int most_looks = 120;
  int looks = 0;
  for (double step = 0.5; step > 0.02; step *= 0.5) {
    for (bool better = true; better;) {
      better = false;
      for (Index i = 0; i < loop_.set.axes.cols(); ++i) {
        for (const double side : {-1.0, 1.0}) {
          if (looks >= most_looks || unstable() || work_ > most_work_) {
            return;
          }
          VectorXd z = best().z;
          z(i) += side * step;
          z = into_set(std::move(z));
          if ((z - best().z).cwiseAbs().maxCoeff() < 1e-3 * step) {
            continue;
          }
          ++looks;
          const VectorXd before = best().z;
          look_at(z);
          better = better || best().z != before;
        }
      }
    }
  }
}

void MemberSearch::run() {
  const Index d = loop_.set.axes.cols();
  look_at(VectorXd::Zero(d));
  for (Index i = 0; i < d; ++i) {
    for (const double side : {-1.0, 1.0}) {
      if (work_ <= most_work_) {
        look_at(VectorXd(side * VectorXd::Unit(d, i)));
      }
    }
  }
  for (unsigned corner = 0; d > 1 && corner < (1u << d) && !unstable() && work_ <= most_work_;
       ++corner) {
    VectorXd z(d);
    for (Index i = 0; i < d; ++i) {
      z(i) = ((corner >> i) & 1u) != 0u ? 1.0 : -1.0;
    }
    look_at(into_set(std::move(z)));
  }
  if (found()) {
    descend([&]() -> const FoundMember& { return slowest_; });
  }
  if (found() && margins_ && !unstable()) {
    descend([&]() -> const FoundMember& { return thinnest_; });
  }
}

}  // namespace flyball::detail
