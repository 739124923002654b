#pragma once

#include <vector>

#include "control/uncertain_loop.hpp"

namespace flyball::detail {

/// A member and where it is.
struct FoundMember {
  Eigen::VectorXd z;
  LoopMember member;
};

/// Members of a set and the worst among those that were looked at.
class MemberSearch {
 public:
  /// @param margins  Whether disk margins matter; without they are not computed.
  /// @param most_work  Floating-point operations after which `run` ends, about.
  MemberSearch(const UncertainLoop& loop, bool margins, double most_work)
      : loop_(loop), margins_(margins), most_work_(most_work) {}

  /// Corners, middles of faces and the centre, then downhill from the worst: twice, for the
  /// spectral radius and for the disk margin. Ends at the first unstable one.
  void run();

  /// Looks at one more; whether it is a member and worse than any before.
  bool look_at(const Eigen::VectorXd& z);

  [[nodiscard]] bool found() const noexcept { return looked_; }
  /// Done so far, floating-point operations.
  [[nodiscard]] double work() const noexcept { return work_; }
  [[nodiscard]] bool unstable() const noexcept {
    return found() && !(slowest_.member.spectral_radius < 1.0);
  }
  [[nodiscard]] const FoundMember& slowest() const noexcept { return slowest_; }
  /// With the smallest disk margin; an unstable one if there is.
  [[nodiscard]] const FoundMember& worst() const noexcept {
    return margins_ && !unstable() ? thinnest_ : slowest_;
  }

 private:
  [[nodiscard]] Eigen::VectorXd into_set(Eigen::VectorXd z) const;
  template <class Found>
  void descend(const Found& found);

  const UncertainLoop& loop_;
  bool margins_;
  double most_work_;
  double work_ = 0.0;
  bool looked_ = false;
  FoundMember slowest_, thinnest_;
};

/// The forms of one member's loop, the channel of α = 2 with it; nothing where it is no member or
/// not finite.
[[nodiscard]] std::optional<FormMatrix> member_loop(const UncertainLoop& loop,
                                                    const Eigen::VectorXd& z, double disk);

/// Whether a member is surely not stable: proven, or, of more than 24 states, beyond rounding.
[[nodiscard]] bool surely_unstable_member(const UncertainLoop& loop, const FoundMember& member);

}  // namespace flyball::detail
