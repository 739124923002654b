#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include "numeric/laws.hpp"
#include "numeric/mu_laws.hpp"
#include "numeric/quad.hpp"
#include "numeric/timing_laws.hpp"

namespace flyball::fuzz {

using nlohmann::json;

namespace {

bool is_finite(const json& value) {
  if (value.is_structured()) {
    return std::all_of(value.begin(), value.end(), is_finite);
  }
  return !value.is_null() && value != "inf" && value != "-inf";
}

class Laws {
 public:
  Laws(const json& problem, const json& answer) : problem_(problem), answer_(answer) {}

  [[nodiscard]] bool has(const char* name) const { return problem_.contains(name); }
  [[nodiscard]] bool answers(const char* name) const { return answer_.contains(name); }
  /// A matrix of the problem.
  [[nodiscard]] Balance given(const char* name) const {
    Balance matrix(quad_matrix(problem_.at(name)));
    // An entry below the smallest normal number is known to within that number: products with it
    // have no sixteen digits.
    constexpr double least = std::numeric_limits<double>::min();
    for (Quad& term : matrix.terms.entries()) {
      term += term > 0 && term < least ? Quad(least) * 1e10 : Quad(0);
    }
    return matrix;
  }
  [[nodiscard]] Balance given_or_zero(const char* name, const Balance& B, const Balance& A) const {
    return has(name) ? given(name) : Balance(QuadMatrix(A.value.columns(), B.value.columns()));
  }
  /// Half of it and of its transpose: what a solver takes of one that is symmetric but for
  /// rounding.
  [[nodiscard]] Balance symmetric(const char* name) const {
    const QuadMatrix M = quad_matrix(problem_.at(name));
    return Balance(Quad(0.5) * (M + transpose(M)));
  }
  [[nodiscard]] const json& of_problem(const char* name) const { return problem_.at(name); }
  [[nodiscard]] const json& of_answer(const char* name) const { return answer_.at(name); }
  /// A matrix of the answer.
  [[nodiscard]] Balance found(const char* name) const {
    return answered(quad_matrix(answer_.at(name)));
  }
  [[nodiscard]] bool discrete() const {
    return problem_.value("domain", std::string("continuous")) == "discrete";
  }

  void holds(std::string law, const Balance& left) { holds(std::move(law), left.defect()); }
  void holds(std::string law, double defect) { verdicts_.push_back({std::move(law), defect}); }

  /// Every answered pole is an eigenvalue of M, and together they are as large as its diagonal.
  void eigenvalues(const Balance& M) {
    const int n = M.value.rows();
    // Poles are rounded to doubles, of which the smallest are not dense; see `answered`.
    const Quad scale = M.terms.largest() + Quad(std::numeric_limits<double>::denorm_min()) * 1e10;
    double worst = 0.0;
    Quad sum = 0;
    for (const json& pole : answer_.at("poles")) {
      const Quad re = pole[0].get<double>();
      const Quad im = pole[1].get<double>();
      sum += re;
      QuadMatrix shifted(2 * n, 2 * n);
      put(shifted, 0, 0, M.value);
      put(shifted, n, n, M.value);
      for (int i = 0; i < n; ++i) {
        shifted(i, i) -= re;
        shifted(n + i, n + i) -= re;
        shifted(i, n + i) = im;
        shifted(n + i, i) = -im;
      }
      const Quad gap = smallest_singular_value(std::move(shifted));
      if (gap > 0) {
        worst = std::max(worst, static_cast<double>(gap / scale));
      }
    }
    Quad trace = 0;
    for (int i = 0; i < n; ++i) {
      trace += M.value(i, i);
    }
    const Quad off = size_of(trace - sum);
    holds("poles", worst);
    holds("sum of poles", off > 0 ? static_cast<double>(off / scale) / n : 0.0);
  }

  [[nodiscard]] std::vector<Verdict> verdicts() && { return std::move(verdicts_); }
  [[nodiscard]] const json& problem() const { return problem_; }
  [[nodiscard]] const json& answer() const { return answer_; }

 private:
  const json& problem_;
  const json& answer_;
  std::vector<Verdict> verdicts_;
};

Balance cost_of(const Balance& Q, const Balance& R, const Balance& N, const Balance& K) {
  const Balance NK = N * K;
  return Q + transpose(K) * R * K - NK - transpose(NK);
}

/// The closed loop's equation, the gain's, and the poles.
void riccati(Laws& laws, const char* solution, bool discrete) {
  const Balance A = laws.given("A");
  const Balance B = laws.given("B");
  const Balance Q = laws.symmetric("Q");
  const Balance R = laws.symmetric("R");
  const Balance N = laws.given_or_zero("N", B, A);
  const Balance X = laws.found(solution);
  const Balance K = laws.found("K");
  const Balance S = A - B * K;
  const Balance XS = X * S;
  if (discrete) {
    laws.holds("closed loop", transpose(S) * XS - X + cost_of(Q, R, N, K));
    laws.holds("gain", (R + transpose(B) * X * B) * K - (transpose(B) * X * A + transpose(N)));
  } else {
    laws.holds("closed loop", XS + transpose(XS) + cost_of(Q, R, N, K));
    laws.holds("gain", R * K - (transpose(B) * X + transpose(N)));
  }
  laws.eigenvalues(S);
}

void kalman(Laws& laws) {
  const Balance A = laws.given("A");
  const Balance C = laws.given("C");
  const Balance Q = laws.symmetric("Q");
  const Balance R = laws.symmetric("R");
  const Balance P = laws.found("P");
  const Balance K = laws.found("K");
  const Balance AK = A * K;
  const Balance S = A - AK * C;
  laws.holds("closed loop", S * P * transpose(S) + AK * R * transpose(AK) + Q - P);
  laws.holds("gain", K * (C * P * transpose(C) + R) - P * transpose(C));
  laws.holds("predictor", laws.found("L") - AK);
  laws.holds("posterior", laws.found("P_posterior") - (P - K * C * P));
  laws.eigenvalues(S);
}

void finite_horizon(Laws& laws) {
  if (!laws.discrete()) {
    return;
  }
  const Balance A = laws.given("A");
  const Balance B = laws.given("B");
  const Balance Q = laws.symmetric("Q");
  const Balance R = laws.symmetric("R");
  const Balance N = laws.given_or_zero("N", B, A);
  const json& gains = laws.answer().at("K");
  const json& costs = laws.answer().at("S");
  for (std::size_t k = 0; k < std::min<std::size_t>(gains.size(), 4); ++k) {
    const Balance K = answered(quad_matrix(gains[k]));
    const Balance S = A - B * K;
    const Balance next = answered(quad_matrix(costs[k + 1]));
    const Balance cost = answered(quad_matrix(costs[k]));
    laws.holds("step", transpose(S) * next * S + cost_of(Q, R, N, K) - cost);
  }
}

Balance ones(int n) {
  return Balance(QuadMatrix::identity(n));
}

/// A function of a matrix, checked by what relative errors of 1e-10 of the matrix do to it.
template <class Function>
void near_function(Laws& laws, std::string law, const QuadMatrix& of, const QuadMatrix& value,
                   const QuadMatrix& wanted, const Function& function) {
  const Quad size = of.largest();
  if (size * tolerance > 0.01 || wanted.rows() == 0) {
    return;  // the error that is allowed is no longer small
  }
  const QuadMatrix exact = function(of);
  Quad allowed = exact.largest();
  for (int turn = 0; turn < 2; ++turn) {
    QuadMatrix moved = of;
    for (int i = 0; i < of.rows(); ++i) {
      for (int j = 0; j < of.columns(); ++j) {
        moved(i, j) += size * Quad((i * 5 + j * 3 + turn * 7) % 4 < 2 ? tolerance : -tolerance);
      }
    }
    allowed = std::max(allowed, (function(moved) - exact).largest() / tolerance);
  }
  allowed += Quad(std::numeric_limits<double>::denorm_min()) * 1e10;
  laws.holds(std::move(law), static_cast<double>((value - exact).largest() / allowed));
}

void exponential_law(Laws& laws) {
  const QuadMatrix A = quad_matrix(laws.problem().at("A"));
  const QuadMatrix X = quad_matrix(laws.answer().at("X"));
  near_function(laws, "exponential", A, X, X, exponential);
}

void logarithm_law(Laws& laws) {
  const QuadMatrix A = quad_matrix(laws.problem().at("A"));
  const QuadMatrix X = quad_matrix(laws.answer().at("X"));
  near_function(laws, "e^X = A", X, A, A, exponential);
}

void power_law(Laws& laws) {
  const Balance A = laws.given("A");
  const Balance X = laws.found("X");
  const double power = laws.problem().at("power");
  if (power == 2.0) {
    laws.holds("square", X - A * A);
  } else if (power == 3.0) {
    laws.holds("cube", X - A * A * A);
  } else if (power == -1.0) {
    laws.holds("inverse", X * A - ones(A.value.rows()));
  } else if (power == 0.5) {
    laws.holds("root", X * X - A);
  } else if (power == 0.25) {
    laws.holds("fourth root", X * X * (X * X) - A);
  } else if (power == -0.5) {
    // X is the inverse root of A + E: X X A - I = -X X E, whatever entries meet in the products.
    const Balance XX = X * X;
    const Balance left = XX * A - ones(A.value.rows());
    const Quad of = std::max(left.terms.largest(), XX.value.largest() * A.value.largest());
    const Quad missed = left.value.largest();
    laws.holds("inverse root", missed > 0 ? static_cast<double>(missed / of) : 0.0);
  }
}

void hold(Laws& laws) {
  const QuadMatrix A = quad_matrix(laws.problem().at("A"));
  const QuadMatrix B = quad_matrix(laws.problem().at("B"));
  if (laws.problem().value("method", std::string("zoh")) != "zoh") {
    return;
  }
  const Quad T = laws.problem().at("T").get<double>();
  const int n = A.rows();
  const int m = B.columns();
  QuadMatrix both(n + m, n + m);
  put(both, 0, 0, T * A);
  put(both, 0, n, T * B);
  QuadMatrix held = QuadMatrix::identity(n + m);
  put(held, 0, 0, quad_matrix(laws.answer().at("A")));
  put(held, 0, n, quad_matrix(laws.answer().at("B")));
  near_function(laws, "zero-order hold", both, held, held, exponential);
}

void gramians(Laws& laws) {
  const Balance A = laws.given("A");
  const Balance B = laws.given("B");
  const Balance C = laws.given("C");
  const Balance Wc = laws.found("Wc");
  const Balance Wo = laws.found("Wo");
  const auto law = [&](const char* name, const Balance& F, const Balance& W, const Balance& G) {
    const Balance FW = F * W;
    laws.holds(name, laws.discrete() ? FW * transpose(F) - W + G * transpose(G)
                                     : FW + transpose(FW) + G * transpose(G));
  };
  law("controllability", A, Wc, B);
  law("observability", transpose(A), Wo, transpose(C));
}

void similarity(Laws& laws) {
  const Balance T = laws.given("transform");
  laws.holds("A", T * laws.found("A") - laws.given("A") * T);
  laws.holds("B", T * laws.found("B") - laws.given("B"));
  if (laws.has("C")) {
    laws.holds("C", laws.found("C") - laws.given("C") * T);
  }
}

void balanced(Laws& laws) {
  if (laws.has("order")) {
    return;
  }
  const Balance T = laws.found("transform");
  const Balance inverse = laws.found("inverse_transform");
  laws.holds("A", laws.found("A") - inverse * laws.given("A") * T);
  laws.holds("B", laws.found("B") - inverse * laws.given("B"));
  laws.holds("transform", inverse * T - ones(T.value.columns()));
}

void inversion(Laws& laws) {
  const Balance B = laws.given("B");
  const int n = B.value.rows();
  const Balance BtQ = transpose(B) * (laws.has("Q") ? laws.symmetric("Q") : ones(n));
  const Balance weight = laws.has("R") ? BtQ * B + laws.symmetric("R") : BtQ * B;
  laws.holds("least squares", weight * laws.found("K_ff") - BtQ);
}

void lyapunov_law(Laws& laws) {
  const Balance AX = laws.given("A") * laws.found("X");
  laws.holds("equation",
             AX + transpose(laws.given("A") * transpose(laws.found("X"))) + laws.given("Q"));
}
void discrete_lyapunov_law(Laws& laws) {
  const Balance X = laws.found("X");
  laws.holds("equation", laws.given("A") * X * transpose(laws.given("A")) - X + laws.given("Q"));
}
void sylvester_law(Laws& laws) {
  const Balance X = laws.found("X");
  laws.holds("equation", laws.given("A") * X + X * laws.given("B") - laws.given("C"));
}
void discrete_sylvester_law(Laws& laws) {
  const Balance X = laws.found("X");
  laws.holds("equation", laws.given("A") * X * laws.given("B") - X + laws.given("C"));
}
void regulator_law(Laws& laws) {
  if (laws.discrete() || !laws.has("T")) {
    riccati(laws, "S", laws.discrete());
  }
}
void placement_law(Laws& laws) {
  laws.eigenvalues(laws.given("A") - laws.given("B") * laws.found("K"));
}
void analysis_law(Laws& laws) {
  laws.eigenvalues(laws.given("A"));
}

/// Pieces follow each other from the first point to the last, as nearly as places can be told: to
/// 1e-14 of a coordinate's extent, and to what coefficients below 2.3e-308 add over a piece.
void spline_law(Laws& laws) {
  const json& coefficients = laws.of_answer("coefficients");
  const json& breaks = laws.of_answer("breaks");
  const json& points = laws.of_problem("points");
  const std::size_t n = points[0].size();
  double worst = 0.0;
  // An entry below 2.3e-308 is known to within that.
  const Quad smallest = Quad(std::numeric_limits<double>::min()) / tolerance;
  for (std::size_t j = 0; j < n; ++j) {
    Quad at = points[0][j].get<double>();
    Quad terms = at < 0 ? -at : at;
    Quad unknown = 0;
    Quad extent = 0;
    for (const json& point : points) {
      extent = std::max(extent, Quad(std::abs(point[j].get<double>())));
    }
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
      const json& row = coefficients[i][j];
      const Quad begin = row[0].get<double>();
      const Quad gap = at - begin;
      const Quad size = terms + (begin < 0 ? -begin : begin);
      if (size > smallest + unknown / tolerance) {
        worst = std::max(worst, static_cast<double>((gap < 0 ? -gap : gap) / size));
      }
      const Quad span = Quad(breaks[i + 1].get<double>()) - Quad(breaks[i].get<double>());
      at = 0;
      terms = 0;
      unknown = 0;
      for (std::size_t k = row.size(); k-- > 0;) {
        const Quad c = row[k].get<double>();
        at = at * span + c;
        unknown = unknown * span + Quad(std::numeric_limits<double>::min());
        terms = terms * span + (c < 0 ? -c : c);
      }
    }
    const Quad end = points[points.size() - 1][j].get<double>();
    const Quad off = at - end;
    const Quad gap = (off < 0 ? -off : off) <= Quad(1e-14) * extent ? Quad(0) : off;
    const Quad size = terms + (end < 0 ? -end : end);
    if (size > smallest + unknown / tolerance) {
      worst = std::max(worst, static_cast<double>((gap < 0 ? -gap : gap) / size));
    }
  }
  laws.holds("one after the other", worst);
}

const std::map<std::string_view, void (*)(Laws&)>& table() {
  static const std::map<std::string_view, void (*)(Laws&)> laws{
      {"dare", [](Laws& l) { riccati(l, "X", true); }},
      {"care", [](Laws& l) { riccati(l, "X", false); }},
      {"lyapunov", lyapunov_law},
      {"discrete-lyapunov", discrete_lyapunov_law},
      {"sylvester", sylvester_law},
      {"discrete-sylvester", discrete_sylvester_law},
      {"expm", exponential_law},
      {"logm", logarithm_law},
      {"powm", power_law},
      {"c2d", hold},
      {"gramians", gramians},
      {"analyze", analysis_law},
      {"similarity-transform", similarity},
      {"balanced-realization", balanced},
      {"lqr", regulator_law},
      {"finite-horizon-lqr", finite_horizon},
      {"place", placement_law},
      {"plant-inversion", inversion},
      {"kalman", kalman},
      {"spline", spline_law},
  };
  return laws;
}

}  // namespace

std::vector<Verdict> check_answer(const solve::Kind& kind, const json& problem,
                                  const json& answer) {
  constexpr double never = std::numeric_limits<double>::infinity();
  for (const solve::Field& field : kind.answer) {
    const auto value = answer.find(std::string(field.name));
    if (value == answer.end() && field.absent == solve::Absent::refused) {
      return {{"has " + std::string(field.name), never}};
    }
    if (value != answer.end() && !field.unbounded && !is_finite(*value)) {
      return {{"finite " + std::string(field.name), never}};
    }
  }
  if (kind.name == "mu") {
    return mu_verdicts(problem, answer);
  }
  if (kind.name == "path-parameterization") {
    return timing_verdicts(problem, answer);
  }
  Laws laws(problem, answer);
  if (const auto found = table().find(kind.name); found != table().end()) {
    found->second(laws);
  }
  return std::move(laws).verdicts();
}

}  // namespace flyball::fuzz
