#pragma once

#include <vector>

#include "control/loop_search.hpp"

namespace flyball::detail {

/// ‖T M x‖ <= decay ‖T x‖ for every member's M; or, where `disk` is positive, a disk margin of it.
struct LoopClaim {
  double decay = 1.0;
  double disk = 0.0;
};

enum class ClaimOutcome { proven, refuted, open };

/// Shows claims over the whole set, piece by piece.
class LoopProver {
 public:
  /// @param search  Is told of members that are worse than those it knows.
  LoopProver(const UncertainLoop& loop, const CertificateOptions& options, MemberSearch& search)
      : loop_(loop), options_(options), search_(search) {}

  /// @param claim  A disk margin is lowered to `closeness` of any smaller one that is met.
  /// @return  `refuted` where the search's slowest member is surely unstable.
  [[nodiscard]] ClaimOutcome show(LoopClaim& claim);

  /// Looked at in the last claim.
  [[nodiscard]] int pieces() const noexcept { return pieces_; }
  /// Of the set's volume: what the last claim left.
  [[nodiscard]] double open_share() const noexcept { return open_share_; }
  [[nodiscard]] std::vector<CertifiedPiece>& proof() noexcept { return proof_; }

 private:
  struct Part {
    SetPiece piece;
    Eigen::MatrixXd T;  ///< That did nearly for the whole of which it is a part; may be empty.
  };
  [[nodiscard]] bool outside(const SetPiece& piece) const;
  /// @param T  Receives the one that was found, or nearly.
  [[nodiscard]] bool show_on(const SetPiece& piece, const DelayBranch& branch,
                             const std::vector<TaylorForm>& parameters, const LoopClaim& claim,
                             Eigen::MatrixXd& T);
  /// Which coordinate to halve: whose slope matters most as T sees it.
  void choose_split(const SetPiece& piece, const MatrixFamily& family, const Eigen::MatrixXd* T);

  const UncertainLoop& loop_;
  const CertificateOptions& options_;
  MemberSearch& search_;
  int pieces_ = 0;
  double work_ = 0.0;
  double open_share_ = 0.0;
  Eigen::Index split_ = 0;
  std::vector<CertifiedPiece> proof_;
};

}  // namespace flyball::detail
