#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "control/loop_prover.hpp"
#include "math/dense/dense.hpp"
#include "math/verified/common_lyapunov.hpp"
#include "math/verified/contraction.hpp"

namespace flyball::detail {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double narrowest = 1e-7;  ///< Half a piece's width in z below which it stays open.

MatrixXd widened(const MatrixXd& T, Index fixed, double scale) {
  MatrixXd full = MatrixXd::Identity(T.rows() + fixed, T.cols() + fixed);
  full.topLeftCorner(T.rows(), T.cols()) = scale * T;
  return full;
}

/// Coordinates for the search of a common T: Lyapunov's of the piece's middle, so scaled that the
/// channel's ends weigh alike.
std::optional<MatrixXd> first_coordinates(const MatrixXd& M, Index fixed) {
  const Index n = M.rows() - fixed;
  const auto T = lyapunov_factor(M.topLeftCorner(n, n));
  if (!T || fixed == 0) {
    return T;
  }
  const MatrixXd inverse = solve_linear(*T, MatrixXd::Identity(n, n));
  const double in = T->lazyProduct(M.topRightCorner(n, fixed)).norm();
  const double out = M.bottomLeftCorner(fixed, n).lazyProduct(inverse).norm();
  const double scale = in > 0.0 && out > 0.0 ? std::sqrt(out / in) : 1.0;
  return widened(*T, fixed, scale);
}

/// The largest Frobenius norm of T M Z.
double largest_gain(const std::vector<MatrixXd>& members, const MatrixXd& T, const MatrixXd& Z) {
  double largest = 0.0;
  for (const MatrixXd& M : members) {
    largest = std::max(largest, T.lazyProduct(M).lazyProduct(Z).norm());
  }
  return largest;
}

/// Slopes that hardly matter are taken for squares: each saves half of the vertices.
void fold_small_slopes(MatrixFamily& family, const MatrixXd& T, const MatrixXd& Z) {
  const Index n = family.centre.rows();
  const double room = 1.0 - eigenvalues_of(family.centre.topLeftCorner(n, n)).cwiseAbs().maxCoeff();
  constexpr double small = 0.05;
  for (std::size_t i = family.slopes.size(); i-- > 0;) {
    if (T.lazyProduct(family.slopes[i]).lazyProduct(Z).norm() < small * room) {
      const int of = family.parameters[i];
      family.squares.push_back(std::move(family.slopes[i]));
      family.pairs.push_back({of, of});
      family.slopes.erase(family.slopes.begin() + static_cast<std::ptrdiff_t>(i));
      family.parameters.erase(family.parameters.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

/// Of one step of Newton's method.
double work_of(std::size_t vertices, Index size, Index fixed) {
  const auto N = static_cast<double>(size);
  const auto n = static_cast<double>(size - fixed);
  const double unknowns = 0.5 * n * (n + 1.0) + 1.0;
  return static_cast<double>(vertices) * (12.0 * N * N * N + 10.0 * unknowns * unknowns) +
         unknowns * unknowns * unknowns / 3.0 + 1000.0;
}

/// Of a loop's enclosure over a piece, as measured beside `work_of`. Inputs under way, one a whole
/// period of delay, are states that are only shifted.
double work_of_enclosure(const UncertainLoop& loop, const std::vector<TaylorForm>& parameters) {
  const auto n = static_cast<double>(loop.C.cols() + loop.A_c.rows() + 1);
  const auto branches = branches_over(parameters.back(), loop.period.si());
  const double late =
      !branches || branches->empty() ? 0.0 : static_cast<double>(branches->back().whole_periods);
  return 2400.0 * n * n * n + 300.0 * late * late + 50'000.0;
}

}  // namespace

bool LoopProver::outside(const SetPiece& piece) const {
  const Index round = loop_.set.round;
  if (round == 0) {
    return false;
  }
  double nearest = 0.0;
  for (Index i = 0; i < round; ++i) {
    const double distance = std::max(0.0, std::abs(piece.middle(i)) - piece.half(i));
    nearest += distance * distance;
  }
  return nearest > 1.0 + 1e-12;
}

void LoopProver::choose_split(const SetPiece& piece, const MatrixFamily& family,
                              const MatrixXd* T) {
  Eigen::Index widest = 0;
  piece.half.maxCoeff(&widest);
  split_ = widest;
  if (T == nullptr || !T->allFinite()) {
    return;
  }
  const MatrixXd Z = solve_linear(*T, MatrixXd::Identity(T->rows(), T->rows()));
  std::array<double, most_parameters> sizes{};
  for (std::size_t i = 0; i < family.slopes.size(); ++i) {
    sizes[static_cast<std::size_t>(family.parameters[i])] +=
        T->lazyProduct(family.slopes[i]).lazyProduct(Z).norm();
  }
  constexpr double bent = 4.0;  // a square becomes a quarter of itself
  for (std::size_t k = 0; k < family.squares.size(); ++k) {
    const double size = bent * T->lazyProduct(family.squares[k]).lazyProduct(Z).norm();
    for (const int of : family.pairs[k]) {
      sizes[static_cast<std::size_t>(of)] += size;
    }
  }
  const auto most = std::max_element(sizes.begin(), sizes.end());
  if (*most > 0.0 && std::isfinite(*most)) {
    split_ = most - sizes.begin();
  }
}

bool LoopProver::show_on(const SetPiece& piece, const DelayBranch& branch,
                         const std::vector<TaylorForm>& parameters, const LoopClaim& claim,
                         MatrixXd& T) {
  work_ += work_of_enclosure(loop_, parameters);
  const auto forms = closed_loop_over(loop_, parameters, branch, claim.disk, claim.decay);
  if (!forms) {
    choose_split(piece, {}, nullptr);
    return false;
  }
  MatrixFamily family = family_of(*forms);
  const Index fixed = claim.disk > 0.0 ? 1 : 0;
  const Index size = family.centre.rows();
  const double eigenvalues = eigenvalue_work(static_cast<double>(size));
  work_ += 3.0 * eigenvalues;  // of Lyapunov's equation
  auto T_0 = first_coordinates(family.centre, fixed);
  if (!T_0) {
    choose_split(piece, family, nullptr);
    return false;
  }
  choose_split(piece, family, &*T_0);
  MatrixXd Z = solve_linear(*T_0, MatrixXd::Identity(size, size));
  fold_small_slopes(family, *T_0, Z);
  const double of_vertices = static_cast<double>(family.vertices()) * eigenvalues;
  work_ += of_vertices;
  if (family.vertices() > 1 && of_vertices > options_.most_work) {
    return false;
  }
  std::vector<MatrixXd> members;
  for (unsigned v = 0; v < family.vertices(); ++v) {
    members.push_back(family.vertex(v));
    if (!(eigenvalues_of(members.back().topLeftCorner(size - fixed, size - fixed))
              .cwiseAbs()
              .maxCoeff() < 1.0)) {
      return false;
    }
  }
  // What did nearly for the whole is a better start than the middle's own, unless it is not.
  if (T.rows() == size) {
    const MatrixXd other = solve_linear(T, MatrixXd::Identity(size, size));
    if (largest_gain(members, T, other) < largest_gain(members, *T_0, Z)) {
      T_0 = T;
      Z = other;
    }
  }
  // Of a loop of many states a single step may take more than all work that is allowed, and more
  // memory than there is.
  const double step = work_of(members.size(), size, fixed);
  const double affordable = (options_.most_work - work_) / step;
  bool found = false;
  if (family.slopes.empty() || affordable < 1.0) {
    T = *T_0;
    found = contracts(family, T);
    work_ += affordable < 1.0 ? step : 0.0;
  }
  if (!found && affordable >= 1.0) {
    std::vector<MatrixXd> vertices;
    for (const MatrixXd& M : members) {
      vertices.push_back(T_0->lazyProduct(M).lazyProduct(Z));
    }
    LyapunovSearch search;
    search.most_steps = static_cast<int>(std::min<double>(search.most_steps, affordable));
    found = common_lyapunov(vertices, fixed, search, [&](const MatrixXd& found_T) {
              return contracts(family, found_T.lazyProduct(*T_0));
            }).has_value();
    work_ += step * (search.steps + 1);
    if (search.last.rows() == size) {
      T = MatrixXd(search.last.lazyProduct(*T_0));
    }
  }
  if (found && options_.keep_proof) {
    proof_.push_back(
        {piece.middle, piece.half, branch.whole_periods, branch.exact, claim.decay, claim.disk, T});
  }
  return found;
}

ClaimOutcome LoopProver::show(LoopClaim& claim) {
  const Index d = loop_.set.axes.cols();
  const std::size_t kept = proof_.size();
  std::vector<Part> open;
  open.push_back({{VectorXd::Zero(d), VectorXd::Ones(d)}, {}});
  pieces_ = 0;
  work_ = 0.0;
  open_share_ = 0.0;
  const auto share = [](const SetPiece& piece) { return piece.half.prod(); };
  while (!open.empty()) {
    auto [piece, T] = std::move(open.back());
    open.pop_back();
    if (outside(piece)) {
      continue;
    }
    if (pieces_ >= options_.most_pieces || work_ > options_.most_work) {
      open_share_ += share(piece);
      continue;
    }
    ++pieces_;
    const auto parameters = parameters_over(loop_.set, piece);
    const auto branches = branches_over(parameters.back(), loop_.period.si());
    const bool shown =
        branches && std::all_of(branches->begin(), branches->end(),
                                [&, &part = piece, &near = T](const DelayBranch& branch) {
                                  return show_on(part, branch, parameters, claim, near);
                                });
    if (shown) {
      continue;
    }
    // A member of the set in the piece may say more than the search has found.
    const Index round = loop_.set.round;
    if (round == 0 || piece.middle.head(round).squaredNorm() <= 1.0) {
      work_ += work_of_enclosure(loop_, parameters);
      const double before = search_.work();
      // Of a member that was looked at before it is known.
      const bool worse = search_.look_at(piece.middle);
      work_ += search_.work() - before;
      if (worse && search_.unstable() && surely_unstable_member(loop_, search_.slowest())) {
        proof_.resize(kept);
        return ClaimOutcome::refuted;
      }
      if (claim.disk > 0.0) {
        claim.disk = std::min(claim.disk, options_.closeness * search_.worst().member.disk_margin);
      }
    }
    if (d == 0 || piece.half(split_) < narrowest || (claim.disk > 0.0 && claim.disk < 1e-4)) {
      open_share_ += share(piece);
      continue;
    }
    for (const double side : {-0.5, 0.5}) {
      Part part{piece, T};
      part.piece.half(split_) *= 0.5;
      part.piece.middle(split_) += side * piece.half(split_);
      open.push_back(std::move(part));
    }
  }
  if (open_share_ > 0.0) {
    proof_.resize(kept);
    return ClaimOutcome::open;
  }
  return ClaimOutcome::proven;
}

}  // namespace flyball::detail
