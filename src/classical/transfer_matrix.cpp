#include <flyball/classical/transfer_matrix.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <flyball/systems/realization.hpp>
#include <flyball/systems/system_error.hpp>

#include "classical/delay_parts.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "systems/zero_pole_gain.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr std::string_view transfer_matrix_noun = "transfer matrix";
using Entries = std::vector<std::vector<ZeroPoleGain>>;

/// The states that `from` reaches along entries of M that are not zero.
std::vector<bool> reached(const MatrixXd& M, const VectorXd& from) {
  std::vector<bool> seen(static_cast<std::size_t>(M.rows()), false);
  std::vector<Index> queue;
  const auto visit = [&](Index i) {
    if (!seen[static_cast<std::size_t>(i)]) {
      seen[static_cast<std::size_t>(i)] = true;
      queue.push_back(i);
    }
  };
  for (Index i = 0; i < M.rows(); ++i) {
    if (from(i) != 0.0) {
      visit(i);
    }
  }
  while (!queue.empty()) {
    const Index j = queue.back();
    queue.pop_back();
    for (Index i = 0; i < M.rows(); ++i) {
      if (M(i, j) != 0.0) {
        visit(i);
      }
    }
  }
  return seen;
}

Expected<ZeroPoleGain> channel(const ContinuousSystem<>& s, Index output, Index input, bool cut,
                               std::optional<Time> period) {
  for (const auto& [i, count, name] :
       {std::tuple{output, s.C.rows(), "output"}, {input, s.B.cols(), "input"}}) {
    FLYBALL_CHECK(check_within(static_cast<double>(i), 0.0, static_cast<double>(count - 1),
                               transfer_matrix_noun, name));
  }
  std::vector<Index> kept;
  const auto moved = reached(s.A, s.B.col(input));
  const auto shown = reached(s.A.transpose(), s.C.row(output).transpose());
  for (Index i = 0; i < s.A.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (!cut || (moved[at] && shown[at])) {
      kept.push_back(i);
    }
  }
  const ContinuousSystem<> part{s.A(kept, kept), s.B(kept, std::vector<Index>{input}),
                                s.C(std::vector<Index>{output}, kept),
                                MatrixXd::Constant(1, 1, s.D(output, input))};
  if (part.A.size() == 0) {
    return ZeroPoleGain::create(VectorXcd(0), VectorXcd(0), part.D(0, 0), period);
  }
  const auto found = flyball::detail::zero_pole_gain(part);
  if (!found) {
    // Nothing passes, or an iteration did not end.
    FLYBALL_TRY(const VectorXcd values, poles(part));
    if (!values.allFinite()) {
      return refusal(SystemError::no_convergence, transfer_matrix_noun, "a pole").got("not found");
    }
    return ZeroPoleGain::create(VectorXcd(0), VectorXcd(0), 0.0, period);
  }
  const auto vector = [](const std::vector<std::complex<double>>& roots) {
    return VectorXcd(Eigen::Map<const VectorXcd>(roots.data(), static_cast<Index>(roots.size())));
  };
  return ZeroPoleGain::create(vector(found->zeros), vector(found->poles), found->gain, period);
}

Expected<TransferMatrix> of_system(const ContinuousSystem<>& s, std::optional<Time> period) {
  Entries entries(static_cast<std::size_t>(s.C.rows()));
  for (Index i = 0; i < s.C.rows(); ++i) {
    for (Index j = 0; j < s.B.cols(); ++j) {
      FLYBALL_TRY(auto entry, channel(s, i, j, true, period));
      entries[static_cast<std::size_t>(i)].push_back(std::move(entry));
    }
  }
  return TransferMatrix::create(std::move(entries));
}

}  // namespace

Expected<TransferMatrix> TransferMatrix::create(Entries entries) {
  if (entries.empty() || entries.front().empty()) {
    return refusal(ArgumentError::empty, transfer_matrix_noun, "the rows of entries").got("empty");
  }
  const auto& period = entries.front().front().period();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].size() != entries.front().size()) {
      return refusal(ArgumentError::wrong_shape, transfer_matrix_noun,
                     flyball::detail::format("row {}", i))
          .got(flyball::detail::format("of {} entries", entries[i].size()))
          .expected(flyball::detail::format("of {}, as the first", entries.front().size()));
    }
    for (std::size_t j = 0; j < entries[i].size(); ++j) {
      const auto& own = entries[i][j].period();
      if (own.has_value() != period.has_value() ||
          (own && std::abs(own->si() - period->si()) > 1e-12 * period->si())) {
        return refusal(TransferError::period_mismatch, transfer_matrix_noun,
                       flyball::detail::format("the sample period of entry ({}, {})", i, j))
            .got(detail::period_text(own))
            .expected(detail::period_text(period) + ", the first's")
            .hint("discretize or resample one of them");
      }
    }
  }
  return TransferMatrix(std::move(entries));
}

Expected<TransferMatrix> TransferMatrix::create(
    const std::vector<std::vector<TransferFunction>>& entries) {
  Entries roots;
  for (const auto& row : entries) {
    auto& made = roots.emplace_back();
    for (const TransferFunction& entry : row) {
      FLYBALL_TRY(auto zpk, ZeroPoleGain::create(entry));
      made.push_back(std::move(zpk));
    }
  }
  return create(std::move(roots));
}

Expected<TransferMatrix> TransferMatrix::of(const ContinuousSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, transfer_matrix_noun));
  return of_system(system, std::nullopt);
}

Expected<TransferMatrix> TransferMatrix::of(const DiscreteSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, transfer_matrix_noun));
  return of_system({system.A, system.B, system.C, system.D}, system.period);
}

bool TransferMatrix::has_delay() const {
  return std::any_of(entries_.begin(), entries_.end(), [](const auto& row) {
    return std::any_of(row.begin(), row.end(),
                       [](const ZeroPoleGain& entry) { return entry.delay() > 0.0; });
  });
}

MatrixXcd TransferMatrix::response(double frequency) const {
  MatrixXcd G(outputs(), inputs());
  for (Index i = 0; i < G.rows(); ++i) {
    for (Index j = 0; j < G.cols(); ++j) {
      G(i, j) = (*this)(i, j).response(frequency);
    }
  }
  return G;
}

MatrixXd TransferMatrix::dc_gain() const {
  MatrixXd G(outputs(), inputs());
  for (Index i = 0; i < G.rows(); ++i) {
    for (Index j = 0; j < G.cols(); ++j) {
      G(i, j) = (*this)(i, j).dc_gain();
    }
  }
  return G;
}

Expected<TransferMatrix> TransferMatrix::without_cancellations(double tolerance) const {
  Entries entries;
  for (const auto& row : entries_) {
    auto& made = entries.emplace_back();
    for (const ZeroPoleGain& entry : row) {
      FLYBALL_TRY(auto left, classical::without_cancellations(entry, tolerance));
      made.push_back(std::move(left.transfer));
    }
  }
  return TransferMatrix(std::move(entries));
}

Expected<DelaySystem> TransferMatrix::to_delay_system() const {
  // Channel (i, j) is fed by input j through its dead time and added to output i.
  std::optional<DelaySystem> all;
  const Index p = outputs();
  const Index m = inputs();
  Wiring wiring{MatrixXd::Zero(p * m, p * m), MatrixXd::Zero(p * m, m), MatrixXd::Zero(p, p * m),
                MatrixXd::Zero(p, m)};
  for (Index i = 0; i < p; ++i) {
    for (Index j = 0; j < m; ++j) {
      const ZeroPoleGain& entry = (*this)(i, j);
      FLYBALL_TRY(const auto s, entry.to_state_space());
      FLYBALL_TRY(const auto rational, entry.period() ? DelaySystem::create(DiscreteSystem<>{
                                                            s.A, s.B, s.C, s.D, *entry.period()})
                                                      : DelaySystem::create(s));
      FLYBALL_TRY(auto late, rational.with_input_delays(VectorXd::Constant(1, entry.delay())));
      if (!all) {
        all = std::move(late);
      } else {
        FLYBALL_TRY(all, append(*all, late));
      }
      wiring.E(i * m + j, j) = 1.0;
      wiring.H(i, i * m + j) = 1.0;
    }
  }
  return rewired(*all, wiring);
}

Expected<ContinuousSystem<>> TransferMatrix::to_continuous(double tolerance) const {
  FLYBALL_TRY(const auto late, to_delay_system());
  FLYBALL_TRY(const auto whole, late.to_continuous());
  return minimal_realization(whole, tolerance).map([](const auto& minimal) {
    return minimal.system;
  });
}

Expected<DiscreteSystem<>> TransferMatrix::to_discrete(double tolerance) const {
  FLYBALL_TRY(const auto late, to_delay_system());
  FLYBALL_TRY(const auto whole, late.to_discrete());
  return minimal_realization(whole, tolerance).map([](const auto& minimal) {
    return minimal.system;
  });
}

Expected<ZeroPoleGain> channel_of(const ContinuousSystem<>& system, Index output, Index input,
                                  bool cut) {
  FLYBALL_CHECK(check_system_or_gain(system, transfer_matrix_noun));
  return channel(system, output, input, cut, std::nullopt);
}

Expected<ZeroPoleGain> channel_of(const DiscreteSystem<>& system, Index output, Index input,
                                  bool cut) {
  FLYBALL_CHECK(check_system_or_gain(system, transfer_matrix_noun));
  return channel({system.A, system.B, system.C, system.D}, output, input, cut, system.period);
}

}  // namespace flyball::classical
