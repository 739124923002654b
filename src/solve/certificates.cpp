#include <utility>

#include <flyball/control/certificate.hpp>
#include <flyball/control/parameter_ellipsoid.hpp>
#include <flyball/control/robust/structured_singular_value.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "solve/row.hpp"

// What holds for every system of a set.
namespace flyball::solve {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Slopes that stand one below the other, taken apart.
Expected<std::vector<MatrixXd>> slopes_of(const Problem& problem, std::string_view name, Index rows,
                                          Index parameters) {
  std::vector<MatrixXd> slopes;
  if (!problem.has(name)) {
    return slopes;
  }
  const MatrixXd& all = problem.matrix(name);
  if (all.rows() != rows * parameters) {
    return refusal(ArgumentError::wrong_shape, "certify", name)
        .got(detail::format("{} rows", all.rows()))
        .expected(detail::format("{}: {} of each of the plant's {} parameters, one below the other",
                                 rows * parameters, rows, parameters));
  }
  for (Index i = 0; i < parameters; ++i) {
    slopes.push_back(all.middleRows(i * rows, rows));
  }
  return slopes;
}

Outcome solve_certify(const Problem& problem, JsonWriter& answer) {
  const MatrixXd& A = problem.matrix("A");
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& C = problem.matrix("C");
  const MatrixXd& K = problem.matrix("K");
  const Index n = A.rows();
  const Time period(problem.number("T"));
  const MatrixXd& low = problem.matrix("low");
  const MatrixXd& high = problem.matrix("high");
  const std::vector<double> from(low.data(), low.data() + low.size());
  const std::vector<double> to(high.data(), high.data() + high.size());
  FLYBALL_TRY(auto set, problem.has("covariance")
                            ? parameter_ellipsoid(from, to, problem.matrix("covariance"),
                                                  problem.number("probability"))
                            : parameter_box(from, to));
  const Index parameters = set.centre.size() - 2;

  LinearPlantFamily family{.A = A, .B = B, .A_p = {}, .B_p = {}, .E = {}, .E_p = {}};
  FLYBALL_TRY(family.A_p, slopes_of(problem, "A_p", n, parameters));
  FLYBALL_TRY(family.B_p, slopes_of(problem, "B_p", n, parameters));
  FLYBALL_TRY(family.E_p, slopes_of(problem, "E_p", n, parameters));

  PlantInputLoop nominal{};
  if (problem.has("K_e")) {
    const ContinuousSystem<> plant{A, B, C, MatrixXd::Zero(C.rows(), 1)};
    FLYBALL_TRY(const auto model, discretize(plant, period));
    FLYBALL_TRY(nominal, observer_regulator_loop(A, B, C, model, K, problem.matrix("K_e"), Time()));
  } else {
    FLYBALL_TRY(nominal, state_feedback_loop(A, B, K, period, Time()));
  }
  const UncertainLoop loop{std::move(family), nominal.C,   period,      nominal.A_c,
                           nominal.B_c,       nominal.C_c, nominal.D_c, std::move(set)};
  // A problem of a stream is answered within about a second.
  FLYBALL_TRY(const auto certificate, certify_loop(loop, {.most_work = 1.5e8}));
  answer.add("verdict", to_string(certificate.verdict));
  answer.add("decay", certificate.decay);
  answer.add("disk_margin", certificate.disk_margin);
  answer.add("gain_down", certificate.gain_down);
  answer.add("gain_up", certificate.gain_up);
  answer.add("phase_margin", certificate.phase_margin);
  // Centre and axis of a box are rounded.
  const Eigen::Map<const VectorXd> least(low.data(), low.size());
  const Eigen::Map<const VectorXd> most(high.data(), high.size());
  answer.add("worst", VectorXd(certificate.worst.parameters.cwiseMax(least).cwiseMin(most)));
  answer.add("worst_radius", certificate.worst.spectral_radius);
  answer.add("worst_disk_margin", certificate.worst.disk_margin);
  answer.add("undecided_share", certificate.undecided_share);
  answer.add("pieces", certificate.pieces);
  return {};
}

/// A system M, or a constant one.
Expected<ContinuousSystem<>> uncertain_system(const Problem& problem) {
  constexpr std::string_view where = "mu";
  const bool constant = problem.has("M");
  const bool matrices = problem.has("A") || problem.has("B") || problem.has("C");
  if (constant == matrices) {
    return refusal(ArgumentError::malformed, where, "the system")
        .got(constant ? "told twice, as M and as matrices" : "left out")
        .expected("M, or A, B and C");
  }
  if (constant) {
    const MatrixXd& M = problem.matrix("M");
    return ContinuousSystem<>{MatrixXd(0, 0), MatrixXd(0, M.cols()), MatrixXd(M.rows(), 0), M};
  }
  for (const char* name : {"A", "B", "C"}) {
    if (!problem.has(name)) {
      return refusal(ArgumentError::malformed, where, name)
          .got("left out")
          .expected("there: a state space has A, B and C");
    }
  }
  if (problem.has("M_imag")) {
    return refusal(ArgumentError::malformed, where, "M_imag")
        .got("beside a state space")
        .expected("a part of M alone");
  }
  const MatrixXd& B = problem.matrix("B");
  const MatrixXd& C = problem.matrix("C");
  return ContinuousSystem<>{
      problem.matrix("A"), B, C,
      problem.has("D") ? problem.matrix("D") : MatrixXd::Zero(C.rows(), B.cols())};
}

void write_complex(JsonWriter& answer, std::string_view name, const Eigen::MatrixXcd& M) {
  answer.add(name, MatrixXd(M.real()));
  answer.add(std::string(name) + "_imag", MatrixXd(M.imag()));
}

/// Bounds of M's largest µ with some of the blocks; of a constant M at no frequency.
Expected<StructuredPeak> peak_of(const Problem& problem, const ContinuousSystem<>& system,
                                 const std::vector<UncertaintyBlock>& blocks) {
  if (problem.has("M")) {
    Eigen::MatrixXcd M = system.D.cast<std::complex<double>>();
    if (problem.has("M_imag")) {
      M.imag() = problem.matrix("M_imag").topLeftCorner(M.rows(), M.cols());
    }
    FLYBALL_TRY(auto mu, structured_singular_value(M, blocks));
    return StructuredPeak{mu.lower,    mu.upper,   0.0, std::move(mu.delta),
                          mu.residual, mu.scaling, 0.0, {}};
  }
  const double dt = problem.number("dt");
  FLYBALL_CHECK(Checks("mu").not_negative(dt, "dt", "s"));
  return dt > 0.0 ? structured_peak(
                        DiscreteSystem<>{system.A, system.B, system.C, system.D, Time(dt)}, blocks)
                  : structured_peak(system, blocks);
}

Outcome solve_mu(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto system, uncertain_system(problem));
  std::vector<UncertaintyBlock> blocks;
  for (const std::string& text : problem.texts("blocks")) {
    FLYBALL_TRY_IN("mu", const auto block, parse_uncertainty_block(text));
    blocks.push_back(block);
  }
  FLYBALL_TRY(const auto peak, peak_of(problem, system, blocks));
  answer.add("lower", peak.lower);
  answer.add("upper", peak.upper);
  if (problem.choice("question") == "performance") {
    if (blocks.size() < 2) {
      return refusal(ArgumentError::wrong_shape, "mu", "blocks")
          .got("one")
          .expected("the uncertain ones, then the performance's");
    }
    const UncertaintyBlock last = blocks.back();
    blocks.pop_back();
    const Index columns = last.kind == UncertaintyKind::full ? last.columns : last.rows;
    ContinuousSystem<> part = system;
    part.B = MatrixXd(part.B.leftCols(part.B.cols() - last.rows));
    part.C = MatrixXd(part.C.topRows(part.C.rows() - columns));
    part.D = MatrixXd(part.D.topLeftCorner(part.C.rows(), part.B.cols()));
    FLYBALL_TRY(const auto stability, peak_of(problem, part, blocks));
    answer.add("stability_lower", stability.lower);
    answer.add("stability_upper", stability.upper);
  }
  if (!problem.has("M")) {
    answer.add("frequency", peak.frequency);
    answer.add("scaling_frequency", peak.scaling_frequency);
    answer.add("stretches", static_cast<int>(peak.stretches.size()));
  }
  write_complex(answer, "delta", peak.delta);
  answer.add("residual", peak.residual);
  write_complex(answer, "D_out", peak.scaling.D_out);
  write_complex(answer, "D_in", peak.scaling.D_in);
  write_complex(answer, "G", peak.scaling.G);
  return {};
}

}  // namespace

std::vector<Kind> certificate_kinds() {
  using namespace field;
  return {
      {"mu",
       "structured singular value of a matrix, or the largest over frequency of a stable system: "
       "bounds of 1/min{σ(Δ) : det(I - M Δ) = 0}, the upper one proven by scalings for all "
       "frequencies, the lower one by a Δ; below one, every Δ with σ(Δ) <= 1 is borne",
       {optional(matrix("M", "p", "m", "a constant one, w to z: z = M w, w = Δ z")),
        optional(matrix("M_imag", "p", "m", "its imaginary part")),
        optional(matrix("A", "n", "n", "or a system: how its states move by themselves")),
        optional(matrix("B", "n", "m", "how w moves them")),
        optional(matrix("C", "p", "n", "how z sees them")),
        optional(matrix("D", "p", "m", "how w reaches z")),
        or_number(number("dt", "s", "sample period; 0 of a continuous system"), 0.0),
        texts("blocks", "K",
              "of Δ, in the order of M's inputs and outputs: \"real\", \"real 3\" (δ I), "
              "\"complex\", \"complex 3\", \"full 2x3\" (rows x columns)"),
        or_first(choice("question", "stability performance",
                        "performance: the last block leads from errors to disturbances, and the "
                        "others' own bounds are answered too"))},
       {number("lower", "", "µ is at least this: 1/σ(delta)"),
        number("upper", "", "and at most this, proven; of a system at every frequency"),
        optional(number("stability_lower", "", "without the last block, of performance")),
        optional(number("stability_upper", "", "likewise: the loop is stable for σ(Δ) < 1/this")),
        unbounded(optional(number("frequency", "rad/s", "of a system, where delta is worst"))),
        unbounded(optional(
            number("scaling_frequency", "rad/s", "of a system, where the bound is largest"))),
        optional(integer("stretches", "of frequencies, each with scalings of its own")),
        matrix("delta", "m", "p", "the smallest Δ found with det(I - M Δ) = 0; zero if none"),
        matrix("delta_imag", "m", "p", "its imaginary part"),
        number("residual", "", "what is left of (I - M Δ) z, relative"),
        matrix("D_out", "p", "p",
               "with D_in and G proves the bound (there): upper² D_in - Mᴴ D_out M - j (G M - Mᴴ "
               "Gᴴ) is positive definite"),
        matrix("D_out_imag", "p", "p", "its imaginary part"),
        matrix("D_in", "m", "m", "the same numbers in the sizes of the inputs"),
        matrix("D_in_imag", "m", "m", "its imaginary part"),
        matrix("G", "m", "p", "of real blocks, Hermitian; else zero"),
        matrix("G_imag", "m", "p", "its imaginary part")},
       R"({"M": [[1, 2, 0], [3, 1, 1], [0, 1, 2]], "blocks": ["real", "complex", "full 1x1"]})",
       &solve_mu},
      {"certify",
       "whether a sampled loop is stable for every plant of a set, proven, and with which margins; "
       "or the plant that breaks it",
       {matrix("A", "n", "n", "the plant where its parameters are zero, continuous"),
        matrix("B", "n", "1", "how its input moves the states"), C,
        number("T", "s", "sample period"),
        matrix("K", "1", "n", "gain of u = -K x_hat", "input/state"),
        optional(matrix("K_e", "n", "p",
                        "filter gain of an observer with the plant above as its model; without it "
                        "the states are fed back",
                        "state/output")),
        list("low", "z", "",
             "the least of each of the plant's parameters, of a factor on its "
             "input, and of the delay in s"),
        list("high", "z", "", "the largest"),
        optional(matrix("covariance", "z", "z",
                        "of estimated ones, whose low and high are the estimate; zeros of the "
                        "others. The set is the joint confidence ellipsoid")),
        or_number(number("probability", "", "that it contains the truth"), 0.95),
        optional(samples("A_p", "i", "n",
                         "how each parameter changes A: matrices, one below the "
                         "other")),
        optional(samples("B_p", "j", "1", "how each changes B, likewise")),
        optional(samples("E_p", "e", "n",
                         "how each changes E of E dx/dt = A x + B u, which is I "
                         "where they are zero"))},
       {text("verdict", "stable: every plant, proven; unstable: the worst is, proven; undecided"),
        number("decay", "", "every plant's spectral radius is below this"),
        number("disk_margin", "", "every plant's is at least this; 0 where none is shown"),
        number("gain_down", "", "every plant bears a gain factor from this"),
        number("gain_up", "", "to this"), number("phase_margin", "deg", "and a phase of this"),
        list("worst", "z", "", "the worst plant that was found: its parameters, gain and delay"),
        number("worst_radius", "", "its spectral radius"),
        number("worst_disk_margin", "", "its disk margin, 0 where it is unstable"),
        number("undecided_share", "", "of the set, where stability was not decided"),
        integer("pieces", "into which the set was cut")},
       R"({"A": [[0, 1], [0, -5]], "B": [[0], [3]], "T": 0.02, "K": [[20, 2]], "low": [-1, 0.8, 0], "high": [1, 1.2, 0.01], "A_p": [[0, 0], [0, 1]]})",
       &solve_certify},
  };
}

}  // namespace flyball::solve
