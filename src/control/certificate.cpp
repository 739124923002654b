#include <flyball/control/certificate.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "control/loop_prover.hpp"
#include "control/sampled_loop.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::string_view in_certify_loop = "certify_loop";

Index plant_parameters(const UncertainLoop& loop) {
  return loop.set.centre.size() - 2;
}

Index plant_states(const UncertainLoop& loop) {
  if (const auto* family = std::get_if<LinearPlantFamily>(&loop.plant)) {
    return family->A.rows();
  }
  return std::get<MechanismFamily>(loop.plant).position ? 2 : 1;
}

Expected<void> check_slopes(const std::vector<MatrixXd>& slopes, std::string_view name, Index count,
                            Index rows, Index columns) {
  if (!slopes.empty() && static_cast<Index>(slopes.size()) != count) {
    return refusal(ArgumentError::wrong_shape, in_certify_loop, name)
        .got(detail::format("{} matrices", slopes.size()))
        .expected(detail::format("one for each of the plant's {} parameters, or none", count));
  }
  for (const MatrixXd& slope : slopes) {
    FLYBALL_CHECK(Checks(in_certify_loop).shape(slope, rows, columns, name).finite(slope, name));
  }
  return {};
}

Expected<void> check_family(const LinearPlantFamily& family, Index count) {
  FLYBALL_CHECK(check_square(family.A, in_certify_loop, "A"));
  const Index n = family.A.rows();
  FLYBALL_CHECK(Checks(in_certify_loop)
                    .finite(family.A, "A")
                    .shape(family.B, n, 1, "B", "states x 1")
                    .finite(family.B, "B"));
  if (family.E.size() > 0) {
    FLYBALL_CHECK(Checks(in_certify_loop).shape(family.E, n, n, "E").finite(family.E, "E"));
  }
  FLYBALL_CHECK(check_slopes(family.A_p, "A_p", count, n, n));
  FLYBALL_CHECK(check_slopes(family.B_p, "B_p", count, n, 1));
  return check_slopes(family.E_p, "E_p", count, n, n);
}

/// The least of a parameter over the set's box.
double least_of(const ParameterSet& set, Index i) {
  return set.centre(i) - set.axes.row(i).cwiseAbs().sum();
}

Expected<void> check_family(const MechanismFamily& family, const ParameterSet& set) {
  if (set.centre.size() != 4) {
    return refusal(ArgumentError::wrong_shape, in_certify_loop, "the set")
        .got(detail::format("{} parameters", set.centre.size()))
        .expected("kV, kA, the gain and the delay");
  }
  FLYBALL_CHECK(
      check_positive(least_of(set, 0), in_certify_loop, "the least kV of the set", "V·s/unit"));
  return family.logarithmic
             ? Expected<void>()
             : check_not_negative(least_of(set, 1) + 1e-15 * std::abs(set.centre(1)),
                                  in_certify_loop, "the least kA of the set", "V·s²/unit");
}

Expected<void> check(const UncertainLoop& loop) {
  const ParameterSet& set = loop.set;
  const Index count = set.centre.size();
  if (count < 2) {
    return refusal(ArgumentError::wrong_shape, in_certify_loop, "the set")
        .got(detail::format("{} parameters", count))
        .expected("those of the plant, the gain and the delay");
  }
  FLYBALL_CHECK(Checks(in_certify_loop)
                    .finite(set.centre, "the set's centre")
                    .shape(set.axes, count, set.axes.cols(), "the set's axes", "parameters x axes")
                    .finite(set.axes, "the set's axes")
                    .positive(loop.period.si(), "period", "s"));
  if (set.axes.cols() > detail::most_parameters || set.round < 0 || set.round > set.axes.cols()) {
    return refusal(ArgumentError::out_of_range, in_certify_loop, "the set")
        .got(detail::format("{} axes, {} of them round", set.axes.cols(), set.round))
        .expected(
            detail::format("at most {} axes, and no more of them round", detail::most_parameters));
  }
  const double most_delay = set.centre(count - 1) + set.axes.row(count - 1).cwiseAbs().sum();
  FLYBALL_CHECK(Checks(in_certify_loop).not_negative(most_delay, "the set's largest delay", "s"));
  if (most_delay > most_delay_periods * loop.period.si()) {
    return refusal(ArgumentError::out_of_range, in_certify_loop, "the set's largest delay")
        .got(format_number(most_delay) + " s")
        .expected(format_number(most_delay_periods) + " periods or less");
  }
  if (const auto* family = std::get_if<LinearPlantFamily>(&loop.plant)) {
    FLYBALL_CHECK(check_family(*family, count - 2));
  } else {
    FLYBALL_CHECK(check_family(std::get<MechanismFamily>(loop.plant), set));
  }
  const Index p = loop.C.rows();
  const Index q = loop.A_c.rows();
  return Checks(in_certify_loop)
      .shape(loop.C, p, plant_states(loop), "C", "outputs x states")
      .shape(loop.A_c, q, q, "A_c")
      .shape(loop.B_c, q, p, "B_c")
      .shape(loop.C_c, 1, q, "C_c")
      .shape(loop.D_c, 1, p, "D_c", "1 x outputs")
      .finite(loop.C, "C")
      .finite(loop.A_c, "A_c")
      .finite(loop.B_c, "B_c")
      .finite(loop.C_c, "C_c")
      .finite(loop.D_c, "D_c");
}

/// The continuous matrices of one member; nothing where E, or a kA of zero, leaves none.
std::optional<std::pair<MatrixXd, MatrixXd>> matrices_of(const UncertainLoop& loop,
                                                         const VectorXd& p) {
  if (const auto* family = std::get_if<LinearPlantFamily>(&loop.plant)) {
    const auto at = [&](MatrixXd M, const std::vector<MatrixXd>& slopes) {
      for (std::size_t i = 0; i < slopes.size(); ++i) {
        M += p(static_cast<Index>(i)) * slopes[i];
      }
      return M;
    };
    const Index n = family->A.rows();
    MatrixXd A = at(family->A, family->A_p);
    MatrixXd B = at(family->B, family->B_p);
    if (family->E.size() > 0 || !family->E_p.empty()) {
      const MatrixXd E =
          at(family->E.size() > 0 ? family->E : MatrixXd(MatrixXd::Identity(n, n)), family->E_p);
      A = detail::solve_linear(E, A);
      B = detail::solve_linear(E, B);
    }
    return A.allFinite() && B.allFinite() ? std::optional(std::pair(A, B)) : std::nullopt;
  }
  const auto& family = std::get<MechanismFamily>(loop.plant);
  const double kA = family.logarithmic ? std::exp(p(1)) : p(1);
  if (!(kA > 0.0)) {
    return std::nullopt;
  }
  if (!family.position) {
    return std::pair(MatrixXd::Constant(1, 1, -p(0) / kA), MatrixXd::Constant(1, 1, 1.0 / kA));
  }
  MatrixXd A{{0.0, 1.0}, {0.0, -p(0) / kA}};
  MatrixXd B{{0.0}, {1.0 / kA}};
  return std::pair(std::move(A), std::move(B));
}

/// Disk margins that are still worth showing where the work does not suffice for a larger one.
constexpr double lesser[] = {1.0, 0.9, 0.7, 0.4};

void show_margins(LoopCertificate& certificate, detail::LoopProver& prover,
                  const detail::MemberSearch& search, const CertificateOptions& options) {
  for (const double share : lesser) {
    // The disk of α = 2 is a half-plane, beyond which the channel says nothing more.
    detail::LoopClaim claim{
        .disk = std::min(1.99, share * options.closeness * search.worst().member.disk_margin)};
    const auto outcome = prover.show(claim);
    certificate.pieces += prover.pieces();
    if (outcome == detail::ClaimOutcome::refuted) {
      certificate.verdict = LoopVerdict::unstable;
      return;
    }
    if (outcome == detail::ClaimOutcome::proven) {
      certificate.verdict = LoopVerdict::stable;
      certificate.disk_margin = claim.disk;
      break;
    }
  }
  const double a = 0.5 * certificate.disk_margin;
  certificate.gain_up = (1.0 + a) / (1.0 - a);
  certificate.gain_down = (1.0 - a) / (1.0 + a);
  certificate.phase_margin = 2.0 * std::atan(a) * 180.0 / std::numbers::pi;
}

void show_decay(LoopCertificate& certificate, detail::LoopProver& prover,
                const detail::MemberSearch& search, const CertificateOptions& options) {
  const double found = search.slowest().member.spectral_radius;
  for (const double share : {0.9, 0.5}) {
    detail::LoopClaim claim{.decay = 1.0 - share * options.closeness * (1.0 - found)};
    const auto outcome = prover.show(claim);
    certificate.pieces += prover.pieces();
    if (outcome == detail::ClaimOutcome::proven) {
      certificate.decay = claim.decay;
      return;
    }
  }
}

}  // namespace

std::string_view to_string(LoopVerdict verdict) {
  switch (verdict) {
    case LoopVerdict::stable:
      return "stable";
    case LoopVerdict::unstable:
      return "unstable";
    case LoopVerdict::undecided:
      break;
  }
  return "undecided";
}

Expected<ParameterSet> parameter_box(const std::vector<double>& low,
                                     const std::vector<double>& high) {
  constexpr std::string_view function = "parameter_box";
  if (low.size() != high.size() || low.size() < 2) {
    return refusal(ArgumentError::wrong_shape, function, "low and high")
        .got(detail::format("{} and {} values long", low.size(), high.size()))
        .expected("one value each of every parameter, the gain and the delay");
  }
  const auto count = static_cast<Index>(low.size());
  ParameterSet set{VectorXd(count), MatrixXd::Zero(count, 0), 0};
  for (std::size_t i = 0; i < low.size(); ++i) {
    FLYBALL_CHECK(Checks(function).finite(low[i], "low").finite(high[i], "high"));
    if (low[i] > high[i]) {
      return refusal(ArgumentError::out_of_range, function, detail::format("parameter {}", i))
          .got(format_number(low[i]) + " to " + format_number(high[i]))
          .expected("a low that is no more than its high");
    }
    const auto at = static_cast<Index>(i);
    set.centre(at) = low[i] + 0.5 * (high[i] - low[i]);
    if (low[i] < high[i]) {
      // Rounded so that both ends are within.
      const double half = std::max(high[i] - set.centre(at), set.centre(at) - low[i]);
      set.axes.conservativeResize(Eigen::NoChange, set.axes.cols() + 1);
      set.axes.col(set.axes.cols() - 1) = VectorXd::Unit(count, at) * detail::rounded_up(half);
    }
  }
  return set;
}

Expected<PlantInputLoop> loop_of(const UncertainLoop& loop, const VectorXd& parameters) {
  FLYBALL_CHECK(check(loop));
  FLYBALL_CHECK(Checks(in_certify_loop)
                    .shape(parameters, loop.set.centre.size(), 1, "parameters")
                    .finite(parameters, "parameters"));
  const auto matrices = matrices_of(loop, parameters.head(plant_parameters(loop)));
  if (!matrices) {
    return refusal(ArgumentError::out_of_range, in_certify_loop, "the member")
        .got("without an equation of motion: its E is singular, or its kA zero")
        .expected("a plant that is one");
  }
  const Index last = parameters.size() - 1;
  return PlantInputLoop{matrices->first,
                        parameters(last - 1) * matrices->second,
                        loop.C,
                        loop.period,
                        Time(std::max(0.0, parameters(last))),
                        loop.A_c,
                        loop.B_c,
                        loop.C_c,
                        loop.D_c};
}

Expected<LoopCertificate> certify_loop(const UncertainLoop& loop,
                                       const CertificateOptions& options) {
  FLYBALL_CHECK(check(loop));
  FLYBALL_CHECK(check_within(options.closeness, 0.0, 0.999, in_certify_loop, "closeness"));
  LoopCertificate certificate;
  detail::MemberSearch search(loop, options.margins, options.most_work);
  search.run();
  if (!search.found()) {
    return refusal(ArgumentError::out_of_range, in_certify_loop, "the set")
        .got("without a member whose loop is finite")
        .expected("plants that can be sampled");
  }
  detail::LoopProver prover(loop, options, search);
  const auto done = [&] {
    certificate.worst = search.worst().member;
    certificate.slowest = search.slowest().member;
    certificate.proof = std::move(prover.proof());
    return certificate;
  };
  if (search.unstable() && detail::surely_unstable_member(loop, search.slowest())) {
    certificate.verdict = LoopVerdict::unstable;
    return done();
  }
  if (options.margins && !search.unstable()) {
    show_margins(certificate, prover, search, options);
    if (certificate.verdict == LoopVerdict::stable) {
      show_decay(certificate, prover, search, options);
    }
  }
  if (certificate.verdict == LoopVerdict::undecided) {
    detail::LoopClaim claim;
    const auto outcome = prover.show(claim);
    certificate.pieces += prover.pieces();
    certificate.undecided_share = prover.open_share();
    certificate.verdict = outcome == detail::ClaimOutcome::proven    ? LoopVerdict::stable
                          : outcome == detail::ClaimOutcome::refuted ? LoopVerdict::unstable
                                                                     : LoopVerdict::undecided;
  }
  return done();
}

}  // namespace flyball
