#include <limits>
#include <vector>

#include <flyball/identification/polynomial_model.hpp>
#include <flyball/identification/subspace.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Models from records of inputs and outputs.
namespace flyball::solve {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
namespace fit = identification;

void write_model(const fit::InnovationsModel& model, JsonWriter& answer) {
  write_system(model.system, answer);
  answer.add("K", model.K);
  answer.add("noise", model.noise);
  answer.add("x0", model.x0);
}

Outcome write_polynomials(const fit::PolynomialFit& found, JsonWriter& answer) {
  const auto rows = [](const std::vector<Eigen::VectorXd>& polynomials) {
    MatrixXd all(static_cast<Index>(polynomials.size()), polynomials.front().size());
    for (std::size_t j = 0; j < polynomials.size(); ++j) {
      all.row(static_cast<Index>(j)) = polynomials[j];
    }
    return all;
  };
  answer.add("a", found.model.A);
  answer.add("b", rows(found.model.B));
  answer.add("c", found.model.C);
  answer.add("d", found.model.D);
  answer.add("f", rows(found.model.F));
  answer.add("parameters", found.parameters);
  answer.add("standard_errors", found.standard_errors);
  answer.add("prediction_fit", found.prediction_fit);
  answer.add("simulation_fit", found.simulation_fit);
  answer.add("aic", found.aic);
  answer.add("bic", found.bic);
  answer.add("mdl", found.mdl);
  answer.add("whiteness", found.whiteness);
  answer.add("input_independence", found.input_independence);
  FLYBALL_TRY(const fit::InnovationsModel states, fit::to_state_space(found.model));
  write_model(states, answer);
  return {};
}

fit::PolynomialOrders orders_of(const Problem& problem) {
  return {.a = problem.integer("a"), .b = problem.integer("b"), .delay = problem.integer("delay")};
}

Outcome solve_arx(const Problem& problem, JsonWriter& answer) {
  const Time T(problem.number("T"));
  const auto [u, y] = std::pair(problem.matrix("u"), problem.matrix("y"));
  const std::string_view select = problem.choice("select");
  FLYBALL_TRY(const fit::PolynomialFit found,
              select == "no" ? fit::fit_arx(u, y, T, orders_of(problem))
                             : fit::select_arx(u, y, T, orders_of(problem),
                                               select == "aic"   ? fit::OrderCriterion::aic
                                               : select == "bic" ? fit::OrderCriterion::bic
                                                                 : fit::OrderCriterion::mdl));
  return write_polynomials(found, answer);
}

Outcome solve_prediction_error(const Problem& problem, JsonWriter& answer) {
  fit::PolynomialOrders orders = orders_of(problem);
  orders.c = problem.integer("c");
  orders.d = problem.integer("d");
  orders.f = problem.integer("f");
  FLYBALL_TRY(const fit::PolynomialFit found,
              fit::fit_prediction_error(problem.matrix("u"), problem.matrix("y"),
                                        Time(problem.number("T")), orders));
  return write_polynomials(found, answer);
}

Outcome solve_subspace(const Problem& problem, JsonWriter& answer) {
  fit::SubspaceOptions options;
  if (problem.has("order")) {
    options.order = problem.integer("order");
  }
  options.most_order = problem.integer("most_order");
  options.block_rows = problem.has("block_rows") ? problem.integer("block_rows") : 0;
  const std::string_view weighting = problem.choice("weighting");
  options.weighting = weighting == "cva"     ? fit::SubspaceWeighting::cva
                      : weighting == "moesp" ? fit::SubspaceWeighting::moesp
                                             : fit::SubspaceWeighting::n4sid;
  options.stable = problem.choice("stability") == "stable";
  options.feedthrough = problem.choice("feedthrough") == "yes";
  FLYBALL_TRY(const fit::SubspaceFit found,
              fit::fit_subspace(problem.matrix("u"), problem.matrix("y"), Time(problem.number("T")),
                                options));
  write_model(found.model, answer);
  answer.add("order", found.order);
  answer.add("singular_values", found.singular_values);
  answer.add("criterion", found.criterion);
  FLYBALL_TRY(const MatrixXd predicted,
              fit::predict(found.model, problem.matrix("u"), problem.matrix("y")));
  FLYBALL_TRY(const Eigen::VectorXd ahead, fit::fit_of(problem.matrix("y"), predicted));
  answer.add("prediction_fit", ahead);
  // An unstable model may have no free run.
  if (const auto simulated = fit::simulate(found.model, problem.matrix("u"))) {
    FLYBALL_TRY(const Eigen::VectorXd free, fit::fit_of(problem.matrix("y"), *simulated));
    answer.add("simulation_fit", free);
  }
  answer.add("noise_determined", found.noise_determined);
  answer.add("stabilized", found.stabilized);
  return {};
}

}  // namespace

std::vector<Kind> identification_kinds() {
  using namespace field;
  const Field u = samples("u", "k", "m", "the inputs, a row a sample");
  const Field y = samples("y", "k", "1", "the output, recorded with them");
  const Field T = number("T", "s", "sample period");
  const Field b = or_number(integer("b", "coefficients of B, of each input"), 1.0);
  const Field delay =
      or_number(integer("delay", "samples from the input to its first effect"), 1.0);
  const auto order = [](std::string_view name, std::string_view help) {
    return or_number(integer(name, help), 0.0);
  };
  const std::vector<Field> model =
      answered_system("n", "m", "p") +
      std::vector{matrix("K", "n", "p", "gain of the steady predictor: x⁺ = Ax + Bu + Ke"),
                  matrix("noise", "p", "p", "covariance of e, a sample", "output²"),
                  list("x0", "n", "", "the state at the first sample")};
  const std::vector<Field> polynomials =
      std::vector{list("a", "v", "", "A, from 1 on: coefficients of 1, q⁻¹, q⁻², …"),
                  matrix("b", "m", "o", "B of each input, its delay included"),
                  list("c", "t", "", "C"),
                  list("d", "x", "", "D"),
                  matrix("f", "m", "l", "F of each input"),
                  list("parameters", "z", "", "all of them but the leading ones"),
                  unbounded(list("standard_errors", "z", "", "of the parameters")),
                  unbounded(number("prediction_fit", "",
                                   "1 - ‖y - ŷ‖/‖y - mean‖ one sample ahead; 1 is perfect")),
                  unbounded(number("simulation_fit", "", "the same in free run")),
                  number("aic", "", "Akaike's criterion"),
                  number("bic", "", "the Bayesian one"),
                  number("mdl", "", "Rissanen's minimum description length"),
                  number("whiteness", "", "of the residuals: below 1 nothing is left in them"),
                  number("input_independence", "", "of the residuals and the inputs, likewise")} +
      model;
  const std::string_view example =
      R"({"u": [1, -1, 2, 0, 1, -2, 0, 1, 1, -1, 2, -2, 1, 0], "y": [0, 1, -0.5, 1.75, 0.9, 1.4, -1.3, -0.6, 0.7, 1.3, -0.3, 1.8, -1.1, 0.5], "T": 0.1, "a": 1, "delay": 1)";
  static const std::string arx = std::string(example) + "}";
  static const std::string armax = std::string(example) + R"(, "c": 1})";
  return {
      {"arx",
       "A(q) y = B(q) u + e by least squares",
       {u, y, T, order("a", "coefficients of A beside the leading 1"), b, delay,
        or_first(choice("select", "no bic aic mdl",
                        "whether a, b and delay are the largest ones, of which the criterion "
                        "chooses"))},
       polynomials,
       arx,
       &solve_arx},
      {"prediction-error",
       "A(q) y = B(q)/F(q) u + C(q)/D(q) e with the least errors one sample ahead: ARMAX (a, b, "
       "c), "
       "output error (b, f), Box-Jenkins (b, c, d, f)",
       {u, y, T, order("a", "coefficients of A beside the leading 1"), b, order("c", "of C"),
        order("d", "of D"), order("f", "of F, of each input"), delay},
       polynomials,
       armax,
       &solve_prediction_error},
      {"subspace",
       "a model of several inputs and outputs in states, its order chosen by singular values "
       "(N4SID, MOESP, CVA)",
       {u, samples("y", "k", "p", "the outputs, recorded with them"), T,
        optional(integer("order", "states; chosen if left out")),
        or_number(integer("most_order", "the largest to choose from"), 10.0),
        optional(integer("block_rows", "samples of past and of future")),
        or_first(choice("weighting", "cva moesp n4sid", "of the singular values")),
        or_first(choice("stability", "as-found stable", "whether unstable poles are reflected")),
        or_first(choice("feedthrough", "yes no", "whether D is estimated, or zero"))},
       model +
           std::vector{
               integer("order", "states"), list("singular_values", "l", "", "of past and future"),
               list("criterion", "z", "", "of each order from 0; the least is taken"),
               unbounded(
                   list("prediction_fit", "p", "", "1 - ‖y - ŷ‖/‖y - mean‖ one sample ahead")),
               optional(unbounded(list("simulation_fit", "p", "", "the same in free run"))),
               flag("noise_determined", "whether the residuals are large enough to tell K"),
               flag("stabilized",
                    "whether poles outside the unit circle, which u and y do not ask for, were "
                    "reflected into it")},
       R"({"u": [1, -1, 2, 0, 1, -2, 0, 1, 1, -1, 2, -2, 1, 0, -1, 1, 2, -2, 0, 1, -1, 2, 1, -1, 0, 2, -2, 1, 1, 0], "y": [0, 1, -0.5, 1.75, 0.9, 1.4, -1.3, -0.6, 0.7, 1.3, -0.3, 1.8, -1.1, 0.5, 0.2, -0.9, 0.6, 2.3, -0.9, -0.4, 0.8, -0.6, 1.7, 1.8, -0.1, -0.1, 2, -1, 0.5, 1.2], "T": 0.1, "order": 1, "block_rows": 3})",
       &solve_subspace},
  };
}

}  // namespace flyball::solve
