#include <utility>

#include <flyball/control/certificate.hpp>
#include <flyball/systems/discretize.hpp>

#include "core/format.hpp"
#include "core/try.hpp"
#include "solve/row.hpp"

// What holds for every system of a set.
namespace flyball::solve {

using Eigen::Index;
using Eigen::MatrixXd;

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
  FLYBALL_TRY(auto set, parameter_box({low.data(), low.data() + low.size()},
                                      {high.data(), high.data() + high.size()}));
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
  FLYBALL_TRY(const auto certificate, certify_loop(loop, {.most_work = 3e8}));
  answer.add("verdict", to_string(certificate.verdict));
  answer.add("decay", certificate.decay);
  answer.add("disk_margin", certificate.disk_margin);
  answer.add("gain_down", certificate.gain_down);
  answer.add("gain_up", certificate.gain_up);
  answer.add("phase_margin", certificate.phase_margin);
  answer.add("worst", certificate.worst.parameters);
  answer.add("worst_radius", certificate.worst.spectral_radius);
  answer.add("worst_disk_margin", certificate.worst.disk_margin);
  answer.add("undecided_share", certificate.undecided_share);
  answer.add("pieces", certificate.pieces);
  return {};
}

}  // namespace

std::vector<Kind> certificate_kinds() {
  using namespace field;
  return {
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
