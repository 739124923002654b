#include <flyball/study/solve.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <flyball/control/lqr.hpp>
#include <flyball/control/pole_placement.hpp>
#include <flyball/core/text.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/math/matrix_equation.hpp>
#include <flyball/math/matrix_exponential.hpp>
#include <flyball/math/matrix_function.hpp>
#include <flyball/math/riccati.hpp>
#include <flyball/systems/controllability.hpp>
#include <flyball/systems/conversion.hpp>
#include <flyball/systems/discretize.hpp>
#include <flyball/systems/gramian.hpp>

#include "study/problem_json.hpp"

namespace flyball::study {

namespace {

using Eigen::MatrixXd;
using Json = nlohmann::json;

/// What a kernel leaves: fields in the writer, or an error.
using Outcome = Expected<void>;

/// A field's shape must fit before zeros of that shape may stand for another.
Eigen::Index columns_of(const MatrixXd& M) {
  return M.cols();
}

Expected<TimeDomain> read_domain(ProblemReader& problem) {
  const std::string name = problem.text("domain");
  if (!problem.status()) {
    return tl::unexpected(problem.status().error());
  }
  if (name == "continuous") {
    return TimeDomain::continuous;
  }
  if (name == "discrete") {
    return TimeDomain::discrete;
  }
  return tl::unexpected(Error(ArgumentError::unknown_name)
                            .about("domain")
                            .got("\"" + name + "\"")
                            .expected("\"continuous\" or \"discrete\""));
}

Outcome riccati(bool continuous, ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  std::optional<MatrixXd> N;
  if (problem.has("N")) {
    N = problem.matrix("N");
  }
  if (!problem.status()) {
    return problem.status();
  }
  const auto solution = continuous ? (N ? care(A, B, Q, R, *N) : care(A, B, Q, R))
                                   : (N ? dare(A, B, Q, R, *N) : dare(A, B, Q, R));
  if (!solution) {
    return tl::unexpected(solution.error());
  }
  answer.add("X", solution->X);
  answer.add("K", solution->K);
  answer.add("poles", solution->poles);
  answer.add("residual", solution->residual);
  answer.add("condition", solution->condition);
  return {};
}

Outcome solve_dare(ProblemReader& problem, AnswerWriter& answer) {
  return riccati(false, problem, answer);
}

Outcome solve_care(ProblemReader& problem, AnswerWriter& answer) {
  return riccati(true, problem, answer);
}

Outcome write_linear(const Expected<LinearMatrixSolution>& solution, AnswerWriter& answer) {
  if (!solution) {
    return tl::unexpected(solution.error());
  }
  answer.add("X", solution->X);
  answer.add("residual", solution->residual);
  answer.add("condition", solution->condition);
  return {};
}

template <auto Function>
Outcome solve_lyapunov(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd Q = problem.matrix("Q");
  return problem.status() ? write_linear(Function(A, Q), answer) : problem.status();
}

template <auto Function>
Outcome solve_sylvester(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const MatrixXd C = problem.matrix("C");
  return problem.status() ? write_linear(Function(A, B, C), answer) : problem.status();
}

Outcome write_matrix(const Expected<MatrixXd>& X, AnswerWriter& answer) {
  if (!X) {
    return tl::unexpected(X.error());
  }
  answer.add("X", *X);
  return {};
}

template <auto Function>
Outcome solve_function(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  return problem.status() ? write_matrix(Function(A), answer) : problem.status();
}

Outcome solve_power(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const double power = problem.number("power");
  return problem.status() ? write_matrix(powm(A, power), answer) : problem.status();
}

/// A, B and, where they are left out, C = I and D = 0.
ContinuousSystem<> read_system(ProblemReader& problem) {
  ContinuousSystem<> system;
  system.A = problem.matrix("A");
  system.B = problem.matrix("B");
  system.C = problem.matrix_or_identity("C", system.A.rows());
  system.D = problem.matrix_or_zero("D", system.C.rows(), columns_of(system.B));
  return system;
}

struct Conversion {
  ConversionMethod method = ConversionMethod::zoh;
  AngularVelocity prewarp{0.0};
};

Expected<Conversion> read_conversion(ProblemReader& problem) {
  Conversion conversion;
  if (problem.has("prewarp")) {
    conversion.prewarp = AngularVelocity(problem.number("prewarp"));
  }
  if (problem.has("method")) {
    const std::string name = problem.text("method");
    if (!problem.status()) {
      return tl::unexpected(problem.status().error());
    }
    auto method = parse_conversion_method(name);
    if (!method) {
      return tl::unexpected(method.error());
    }
    conversion.method = *method;
  }
  if (!problem.status()) {
    return tl::unexpected(problem.status().error());
  }
  return conversion;
}

template <class System>
void write_system(const System& system, AnswerWriter& answer) {
  answer.add("A", system.A);
  answer.add("B", system.B);
  answer.add("C", system.C);
  answer.add("D", system.D);
}

Outcome solve_c2d(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = read_system(problem);
  const Time period(problem.number("T"));
  const auto conversion = read_conversion(problem);
  if (!conversion) {
    return tl::unexpected(conversion.error());
  }
  const auto discrete =
      convert_to_discrete(system, period, conversion->method, conversion->prewarp);
  if (!discrete) {
    return tl::unexpected(discrete.error());
  }
  write_system(*discrete, answer);
  if (problem.has("Q")) {
    const MatrixXd Q = problem.matrix("Q");
    if (!problem.status()) {
      return problem.status();
    }
    const auto noise = discretize(system.A, ProcessDensity{Q}, period);
    if (!noise) {
      return tl::unexpected(noise.error());
    }
    answer.add("Q", *noise);
  }
  if (problem.has("R")) {
    const MatrixXd R = problem.matrix("R");
    if (!problem.status()) {
      return problem.status();
    }
    const auto noise = discretize(MeasurementDensity{R}, period);
    if (!noise) {
      return tl::unexpected(noise.error());
    }
    answer.add("R", *noise);
  }
  return {};
}

Outcome solve_d2c(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> matrices = read_system(problem);
  const Time period(problem.number("T"));
  const auto conversion = read_conversion(problem);
  if (!conversion) {
    return tl::unexpected(conversion.error());
  }
  const auto continuous =
      convert_to_continuous({matrices.A, matrices.B, matrices.C, matrices.D, period},
                            conversion->method, conversion->prewarp);
  if (!continuous) {
    return tl::unexpected(continuous.error());
  }
  write_system(*continuous, answer);
  return {};
}

/// A and B are continuous: with T the plant is sampled and the weights are the discrete cost's, as
/// in Theorem 7.7.1; "domain": "discrete" says that A and B are sampled already.
Outcome solve_lqr(ProblemReader& problem, AnswerWriter& answer) {
  MatrixXd A = problem.matrix("A");
  MatrixXd B = problem.matrix("B");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  const MatrixXd N = problem.matrix_or_zero("N", A.rows(), B.cols());
  bool discrete = false;
  if (problem.has("domain")) {
    const auto domain = read_domain(problem);
    if (!domain) {
      return tl::unexpected(domain.error());
    }
    discrete = *domain == TimeDomain::discrete;
  }
  if (!problem.status()) {
    return problem.status();
  }
  if (problem.has("T") && !discrete) {
    const double period = problem.number("T");
    if (!problem.status()) {
      return problem.status();
    }
    auto sampled = discretize_zoh(A, B, Time(period));
    if (!sampled) {
      return tl::unexpected(sampled.error());
    }
    A = std::move(sampled->A);
    B = std::move(sampled->B);
    discrete = true;
  }
  const auto solution = discrete ? dare(A, B, Q, R, N) : care(A, B, Q, R, N);
  if (!solution) {
    return tl::unexpected(Error(solution.error()).in("lqr"));
  }
  answer.add("K", solution->K);
  answer.add("S", solution->X);
  answer.add("poles", solution->poles);
  answer.add("residual", solution->residual);
  answer.add("condition", solution->condition);
  return {};
}

Outcome solve_place(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd B = problem.matrix("B");
  const Eigen::VectorXcd poles = problem.complex_list("poles");
  if (!problem.status()) {
    return problem.status();
  }
  const auto placed = place(A, B, poles);
  if (!placed) {
    return tl::unexpected(placed.error());
  }
  answer.add("K", placed->K);
  answer.add("poles", Eigen::VectorXcd(placed->poles));
  answer.add("condition", placed->condition);
  return {};
}

Outcome solve_kalman(ProblemReader& problem, AnswerWriter& answer) {
  const MatrixXd A = problem.matrix("A");
  const MatrixXd C = problem.matrix("C");
  const MatrixXd Q = problem.matrix("Q");
  const MatrixXd R = problem.matrix("R");
  if (!problem.status()) {
    return problem.status();
  }
  const auto gain = kalman_gain(A, C, Q, R);
  if (!gain) {
    return tl::unexpected(gain.error());
  }
  answer.add("K", gain->K);
  answer.add("P", gain->P_prior);
  answer.add("poles", Eigen::VectorXcd(gain->poles));
  answer.add("P_posterior", gain->P_posterior);
  answer.add("L", gain->L);
  answer.add("residual", gain->residual);
  answer.add("condition", gain->condition);
  return {};
}

Outcome solve_gramians(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = read_system(problem);
  const auto domain = read_domain(problem);
  if (!domain) {
    return tl::unexpected(domain.error());
  }
  const auto controllability = controllability_gramian(system.A, system.B, *domain);
  if (!controllability) {
    return tl::unexpected(controllability.error());
  }
  const auto observability = observability_gramian(system.A, system.C, *domain);
  if (!observability) {
    return tl::unexpected(observability.error());
  }
  answer.add("Wc", controllability->W);
  answer.add("Wo", observability->W);
  answer.add("stable", controllability->is_energy);
  if (controllability->is_energy) {
    const auto hankel = *domain == TimeDomain::continuous
                            ? hankel_singular_values(system)
                            : hankel_singular_values(DiscreteSystem<>{system.A, system.B, system.C,
                                                                      system.D, Time(1.0)});
    if (hankel) {
      answer.add_list("hankel_singular_values", *hankel);
    }
  }
  answer.add("residual", std::max(controllability->residual, observability->residual));
  answer.add("condition", std::max(controllability->condition, observability->condition));
  return {};
}

Eigen::VectorXcd hidden_modes(const ReachAnalysis& analysis) {
  std::vector<std::complex<double>> modes;
  for (const ModeReach& mode : analysis.modes) {
    if (!mode.reached) {
      modes.push_back(mode.eigenvalue);
    }
  }
  return Eigen::Map<const Eigen::VectorXcd>(modes.data(), static_cast<Eigen::Index>(modes.size()));
}

void write_reach(const ReachAnalysis& analysis, const std::string& prefix, std::string_view hidden,
                 AnswerWriter& answer) {
  answer.add(hidden, hidden_modes(analysis));
  answer.add(prefix + "_rank", static_cast<double>(analysis.rank));
  answer.add(prefix + "_condition", analysis.matrix_condition);
  Eigen::VectorXd distances(static_cast<Eigen::Index>(analysis.modes.size()));
  Eigen::VectorXcd modes(distances.size());
  for (Eigen::Index k = 0; k < distances.size(); ++k) {
    distances(k) = analysis.modes[static_cast<std::size_t>(k)].distance;
    modes(k) = analysis.modes[static_cast<std::size_t>(k)].eigenvalue;
  }
  answer.add(prefix + "_modes", modes);
  answer.add_list(prefix + "_distances", distances);
}

Outcome solve_analyze(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = read_system(problem);
  const auto domain = read_domain(problem);
  if (!domain) {
    return tl::unexpected(domain.error());
  }
  if (auto checked = check_system(system, "analyze"); !checked) {
    return checked;
  }
  const auto controllability = analyze_controllability(system.A, system.B, *domain);
  if (!controllability) {
    return tl::unexpected(controllability.error());
  }
  const auto observability = analyze_observability(system.A, system.C, *domain);
  if (!observability) {
    return tl::unexpected(observability.error());
  }
  const Time period(problem.has("T") ? problem.number("T") : 1.0);
  if (!problem.status()) {
    return problem.status();
  }
  const auto modes = analyze_modes(system.A, *domain, period);
  if (!modes) {
    return tl::unexpected(modes.error());
  }
  answer.add("controllable", controllability->controllable);
  answer.add("observable", observability->observable);
  answer.add("stabilizable", controllability->stabilizable);
  answer.add("detectable", observability->detectable);
  answer.add_json("stability", "\"" + std::string(to_string(modes->stability)) + "\"");
  Eigen::VectorXcd poles(static_cast<Eigen::Index>(modes->modes.size()));
  Eigen::VectorXd damping(poles.size());
  Eigen::VectorXd frequency(poles.size());
  for (Eigen::Index k = 0; k < poles.size(); ++k) {
    const Mode& mode = modes->modes[static_cast<std::size_t>(k)];
    poles(k) = mode.pole;
    damping(k) = mode.damping_ratio;
    frequency(k) = mode.natural_frequency;
  }
  answer.add("poles", poles);
  answer.add_list("damping_ratios", damping);
  answer.add_list("natural_frequencies", frequency);
  write_reach(*controllability, "controllability", "uncontrollable_modes", answer);
  write_reach(*observability, "observability", "unobservable_modes", answer);
  answer.add_json("words",
                  Json(describe(*controllability) + "\n" + describe(*observability)).dump());
  return {};
}

/// x and y at the samples of u, exactly, the input held between them.
Outcome solve_simulate(ProblemReader& problem, AnswerWriter& answer) {
  const ContinuousSystem<> system = read_system(problem);
  const auto domain = read_domain(problem);
  if (!domain) {
    return tl::unexpected(domain.error());
  }
  const MatrixXd u = problem.matrix("u");
  const MatrixXd x0 = problem.matrix_or_zero("x0", system.A.rows(), 1);
  const double period = problem.has("T") ? problem.number("T") : 1.0;
  if (!problem.status()) {
    return problem.status();
  }
  constexpr std::string_view where = "simulate";
  if (auto checked = check_system(system, where); !checked) {
    return checked;
  }
  const Eigen::Index n = system.A.rows();
  if (auto checked =
          check_all(check_shape(u, u.rows(), system.B.cols(), where, "u", "samples x inputs"),
                    check_shape(x0, n, 1, where, "x0", "states x 1"), check_finite(u, where, "u"),
                    check_finite(x0, where, "x0"));
      !checked) {
    return checked;
  }
  DiscretizedMatrices model{system.A, system.B};
  if (*domain == TimeDomain::continuous) {
    if (!problem.has("T")) {
      return tl::unexpected(Error(ArgumentError::malformed)
                                .in(std::string(where))
                                .about("T")
                                .got("left out")
                                .expected("the time between the rows of u in seconds"));
    }
    auto sampled = discretize_zoh(system.A, system.B, Time(period));
    if (!sampled) {
      return tl::unexpected(sampled.error());
    }
    model = *std::move(sampled);
  }
  MatrixXd x(u.rows() + 1, n);
  MatrixXd y(u.rows(), system.C.rows());
  Eigen::VectorXd state = x0;
  x.row(0) = state.transpose();
  for (Eigen::Index k = 0; k < u.rows(); ++k) {
    const Eigen::VectorXd input = u.row(k).transpose();
    y.row(k) = (system.C * state + system.D * input).transpose();
    state = (model.A * state + model.B * input).eval();
    x.row(k + 1) = state.transpose();
  }
  answer.add("x", x);
  answer.add("y", y);
  return {};
}

using Kernel = Outcome (*)(ProblemReader&, AnswerWriter&);

constexpr std::array kinds{
    SolveKind{"dare", "A B Q R", "N", "X K poles residual condition"},
    SolveKind{"care", "A B Q R", "N", "X K poles residual condition"},
    SolveKind{"lyapunov", "A Q", "", "X residual condition"},
    SolveKind{"discrete-lyapunov", "A Q", "", "X residual condition"},
    SolveKind{"sylvester", "A B C", "", "X residual condition"},
    SolveKind{"discrete-sylvester", "A B C", "", "X residual condition"},
    SolveKind{"expm", "A", "", "X"},
    SolveKind{"logm", "A", "", "X"},
    SolveKind{"powm", "A power", "", "X"},
    SolveKind{"c2d", "A B T", "C D method prewarp Q R", "A B C D Q R"},
    SolveKind{"d2c", "A B T", "C D method prewarp", "A B C D"},
    SolveKind{"lqr", "A B Q R", "N T domain", "K S poles residual condition"},
    SolveKind{"place", "A B poles", "", "K poles condition"},
    SolveKind{"kalman", "A C Q R", "", "K P poles P_posterior L residual condition"},
    SolveKind{"gramians", "A B C domain", "", "Wc Wo stable hankel_singular_values"},
    SolveKind{"analyze", "A B domain", "C D T",
              "controllable observable stabilizable detectable …"},
    SolveKind{"simulate", "A B u domain", "C D T x0", "x y"},
};

constexpr std::array<Kernel, kinds.size()> kernels{
    solve_dare,
    solve_care,
    solve_lyapunov<lyapunov>,
    solve_lyapunov<discrete_lyapunov>,
    solve_sylvester<sylvester>,
    solve_sylvester<discrete_sylvester>,
    solve_function<expm>,
    solve_function<logm>,
    solve_power,
    solve_c2d,
    solve_d2c,
    solve_lqr,
    solve_place,
    solve_kalman,
    solve_gramians,
    solve_analyze,
    solve_simulate,
};

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> list;
  while (!text.empty()) {
    const std::size_t space = text.find(' ');
    list.push_back(text.substr(0, space));
    text = space == std::string_view::npos ? std::string_view() : text.substr(space + 1);
  }
  return list;
}

std::string joined(const std::vector<std::string_view>& names) {
  std::string text;
  for (const std::string_view name : names) {
    text += (text.empty() ? "" : ", ") + std::string(name);
  }
  return text;
}

bool contains(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t space = list.find(' ');
    if (list.substr(0, space) == word) {
      return true;
    }
    list = space == std::string_view::npos ? std::string_view() : list.substr(space + 1);
  }
  return false;
}

/// Every field known, every necessary one there.
Outcome check_fields(const Json& object, const SolveKind& kind) {
  for (const auto& [name, value] : object.items()) {
    if (name == "id" || contains(kind.fields, name) || contains(kind.optional, name)) {
      continue;
    }
    std::vector<std::string_view> known = words(kind.fields);
    for (const std::string_view other : words(kind.optional)) {
      known.push_back(other);
    }
    const std::string nearest = nearest_name(name, known);
    return tl::unexpected(
        Error(ArgumentError::unknown_name)
            .in(std::string(kind.name))
            .about("field")
            .got("\"" + name.substr(0, 40) + "\"")
            .expected("one of " + joined(known))
            .hint(nearest.empty() ? "take it out" : "did you mean \"" + nearest + "\"?"));
  }
  for (const std::string_view name : words(kind.fields)) {
    const auto found = object.find(name);
    if (found == object.end() || found->is_null()) {
      return tl::unexpected(
          Error(ArgumentError::malformed)
              .in(std::string(kind.name))
              .about(std::string(name))
              .got("left out")
              .expected("a problem with the fields " + joined(words(kind.fields))));
    }
  }
  return {};
}

/// Brackets of a text that are open at once, strings left out. Writing a value (an id) recurses.
int depth_of(std::string_view text) {
  int depth = 0;
  int deepest = 0;
  bool quoted = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (quoted) {
      if (c == '\\') {
        ++k;
      } else if (c == '"') {
        quoted = false;
      }
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      deepest = std::max(deepest, ++depth);
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return deepest;
}

SolveAnswer refused(AnswerWriter& answer, const Json* id, const Error& error) {
  answer.begin(id);
  answer.add(error);
  return {answer.end(), false, error.kind()};
}

}  // namespace

std::span<const SolveKind> solve_kinds() {
  return kinds;
}

Expected<Solver> Solver::create(std::string_view kind) {
  std::vector<std::string_view> names;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (kinds[k].name == kind) {
      return Solver(k);
    }
    names.push_back(kinds[k].name);
  }
  const std::string nearest = nearest_name(kind, names);
  return tl::unexpected(Error(ArgumentError::unknown_name)
                            .in("solve")
                            .about("kind of problem")
                            .got("\"" + std::string(kind.substr(0, 40)) + "\"")
                            .expected("one of " + joined(names))
                            .hint(nearest.empty() ? "" : "did you mean \"" + nearest + "\"?"));
}

std::string Solver::error_json(const Error& error) {
  AnswerWriter answer;
  answer.begin(nullptr);
  answer.add(error);
  return answer.end();
}

bool Solver::is_complete(std::string_view text) {
  return Json::accept(text);
}

SolveAnswer Solver::solve(std::string_view problem) const {
  AnswerWriter answer;
  constexpr int deepest = 64;
  if (const int depth = depth_of(problem); depth > deepest) {
    return refused(answer, nullptr,
                   Error(ArgumentError::malformed)
                       .in(std::string(kinds[index_].name))
                       .about("problem")
                       .got(std::to_string(depth) + " brackets within each other")
                       .expected("at most " + std::to_string(deepest)));
  }
  const Json object = Json::parse(problem, nullptr, false);
  if (object.is_discarded() || !object.is_object()) {
    return refused(answer, nullptr,
                   Error(ArgumentError::malformed)
                       .in(std::string(kinds[index_].name))
                       .about("problem")
                       .got(object.is_discarded() ? "text that is not JSON, or is cut off"
                                                  : std::string(object.type_name()))
                       .expected("one JSON object on a line, such as {\"A\": [[1]], …}"));
  }
  const auto found = object.find("id");
  const Json* const id = found == object.end() ? nullptr : &*found;
  if (const Outcome fields = check_fields(object, kinds[index_]); !fields) {
    return refused(answer, id, fields.error());
  }
  ProblemReader reader(object, kinds[index_].name);
  answer.begin(id);
  if (const Outcome outcome = kernels[index_](reader, answer); !outcome) {
    return refused(answer, id, outcome.error());
  }
  return {answer.end(), true, ErrorKind::no_answer};
}

}  // namespace flyball::study
