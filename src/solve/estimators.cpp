#include <flyball/control/observer_placement.hpp>
#include <flyball/estimation/autocovariance.hpp>
#include <flyball/estimation/kalman_gain.hpp>
#include <flyball/estimation/smoother.hpp>
#include <flyball/math/probability/gaussian_vector.hpp>

#include "core/try.hpp"
#include "solve/row.hpp"

// Gains of observers, and estimates.
namespace flyball::solve {

namespace {

Outcome solve_kalman(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto gain, kalman_gain(problem.matrix("A"), problem.matrix("C"),
                                           problem.matrix("Q"), problem.matrix("R")));
  answer.add("K", gain.K);
  answer.add("P", gain.P_prior);
  answer.add("poles", Eigen::VectorXcd(gain.poles));
  answer.add("P_posterior", gain.P_posterior);
  answer.add("L", gain.L);
  answer.add("residual", gain.residual);
  answer.add("condition", gain.condition);
  return {};
}

Expected<ObserverPlacement> with_domain(const Problem& problem) {
  const Eigen::MatrixXd& A = problem.matrix("A");
  const Eigen::MatrixXd& C = problem.matrix("C");
  const ContinuousSystem<> plant{A, Eigen::MatrixXd::Zero(A.rows(), 1), C,
                                 Eigen::MatrixXd::Zero(C.rows(), 1)};
  const Eigen::VectorXcd& poles = problem.complex_list("poles");
  return problem.domain() == TimeDomain::continuous
             ? place_observer(plant, poles)
             : place_observer(DiscreteSystem<>{plant.A, plant.B, plant.C, plant.D, Time(1.0)},
                              poles);
}

Outcome solve_place_observer(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto observer, with_domain(problem));
  answer.add("L", observer.L);
  if (observer.K) {
    answer.add("K", *observer.K);
  }
  answer.add("poles", observer.poles);
  answer.add("condition", observer.condition);
  answer.add("pole_error", observer.pole_error);
  return {};
}

Outcome solve_smooth(const Problem& problem, JsonWriter& answer) {
  const Eigen::MatrixXd& y = problem.matrix("y");
  LinearStep step{problem.matrix("A"), {}, problem.matrix("Q"), problem.matrix("C"),
                  problem.matrix("R"), {}};
  std::vector<LinearStep> steps;
  for (Eigen::Index k = 0; k < y.rows(); ++k) {
    step.input = problem.matrix("added").row(k).transpose();
    step.y = y.row(k).transpose();
    steps.push_back(step);
  }
  FLYBALL_TRY(const auto result, smooth(Eigen::VectorXd(problem.matrix("x0")), problem.matrix("P0"),
                                        std::span<const LinearStep>(steps)));
  answer.add("x", Eigen::MatrixXd(result.smoothed.x.transpose()));
  answer.add("P", result.smoothed.P);
  answer.add("x_filtered", Eigen::MatrixXd(result.x_filtered.transpose()));
  answer.add("log_likelihood", result.log_likelihood);
  answer.add("nis", result.nis);
  return {};
}

Outcome solve_noise_covariances(const Problem& problem, JsonWriter& answer) {
  const bool diagonal = problem.choice("structure") == "diagonal";
  const Eigen::MatrixXd no_gain;
  FLYBALL_TRY(const auto fit, fit_noise_by_autocovariances(
                                  problem.matrix("A"), problem.matrix("C"), problem.matrix("G"),
                                  Eigen::MatrixXd(problem.matrix("y").transpose()),
                                  Eigen::MatrixXd(problem.matrix("added").transpose()),
                                  problem.has("L") ? problem.matrix("L") : no_gain,
                                  {.lags = problem.integer("lags"),
                                   .diagonal_process = diagonal,
                                   .diagonal_measurement = diagonal}));
  answer.add("Q", fit.Q);
  answer.add("R", fit.R);
  answer.add("Q_std", fit.Q_std);
  answer.add("R_std", fit.R_std);
  answer.add("lags", static_cast<double>(fit.lags));
  answer.add("misfit", fit.misfit);
  answer.add("at_boundary", fit.at_boundary);
  answer.add("optimality", fit.optimality);
  answer.add("condition", fit.condition);
  return {};
}

Outcome solve_bayes(const Problem& problem, JsonWriter& answer) {
  FLYBALL_TRY(const auto prior,
              GaussianVector::create(problem.matrix("mean"), problem.matrix("covariance")));
  FLYBALL_TRY(const auto posterior,
              prior.measured(problem.matrix("C"), problem.matrix("R"), problem.matrix("y")));
  answer.add("mean", posterior.estimate.mean());
  answer.add("covariance", posterior.estimate.covariance());
  answer.add("squared_distance", posterior.squared_distance);
  answer.add("log_evidence", posterior.log_evidence);
  return {};
}

}  // namespace

std::vector<Kind> estimator_kinds() {
  using namespace field;
  return {
      {"kalman",
       "the steady state of a Kalman filter: P = APAᵀ + Q - APCᵀ(CPCᵀ + R)⁻¹CPAᵀ (9.6)",
       {matrix("A", "n", "n", "how the states move by themselves, sampled"),
        matrix("C", "p", "n", "how the outputs see the states"),
        matrix("Q", "n", "n", "covariance of the process noise, a sample", "state²"),
        matrix("R", "p", "p", "covariance of the measurement noise, a sample", "output²")},
       {matrix("K", "n", "p", "the filter's gain, PCᵀ(CPCᵀ + R)⁻¹ (9.22)"),
        matrix("P", "n", "n", "error covariance before an update", "state²"),
        complex_list("poles", "n", "eigenvalues of A - LC"),
        matrix("P_posterior", "n", "n", "error covariance after an update", "state²"),
        matrix("L", "n", "p", "the predictor's gain, AK"), riccati_residual, condition},
       R"({"A": [[1, 0.02], [0, 1]], "C": [[1, 0]], "Q": [[0, 0], [0, 0.01]], "R": [[0.0001]]})",
       &solve_kalman},
      {"place_observer",
       "the gain with which the errors of an observer, A - LC, have given eigenvalues (9.2)",
       {A, matrix("C", "p", "n", "how the outputs see the states"),
        complex_list("poles", "n", "where they are to be"), or_first(domain)},
       {matrix("L", "n", "p", "the gain of the observer in one step (9.1, 9.3)"),
        optional(matrix("K", "n", "p", "A⁻¹L, of predict and update apart (9.6)")),
        complex_list("poles", "n", "where they are with this L, in the same order"),
        unbounded(number("condition", "", "how much a relative error of A - LC moves a pole")),
        number("pole_error", "",
               "no pole is further from its place, relative to itself (at 0: to the largest pole); "
               "at most 0.1")},
       R"({"A": [[0, 1], [0, 0]], "C": [[1, 0]], "poles": [[-1, 1], [-1, -1]]})",
       &solve_place_observer},
      {"smooth",
       "the states by the measurements before and after them: Kalman filter and smoother (9.7)",
       {matrix("A", "n", "n", "how the states move by themselves, sampled"),
        or_identity(matrix("C", "p", "n", "how the outputs see the states")),
        matrix("Q", "n", "n", "covariance of the process noise, a sample", "state²"),
        matrix("R", "p", "p", "covariance of the measurement noise, a sample", "output²"),
        matrix("P0", "n", "n", "error covariance before the first step", "state²"),
        or_zero(samples("x0", "n", "1", "the state before the first step")),
        samples("y", "k", "p", "what was measured after each step, a row a step"),
        or_zero(samples("added", "k", "n", "what the inputs add to the states in each step, Bu"))},
       {matrix("x", "k+1", "n", "the states, smoothed, from before the first step on"),
        matrices("P", "n", "n", "their error covariances"),
        matrix("x_filtered", "k+1", "n", "by the measurements up to each step alone"),
        number("log_likelihood", "", "logarithm of the measurements' density"),
        list("nis", "k", "", "normalised innovations squared")},
       R"({"A": [[1, 0.1], [0, 1]], "C": [[1, 0]], "Q": [[0, 0], [0, 0.01]], "R": [[0.1]], "P0": [[1, 0], [0, 1]], "y": [0.1, 0.3, 0.2]})",
       &solve_smooth},
      {"noise_covariances",
       "the covariances of a system's noises from its outputs: autocovariance least squares",
       {matrix("A", "n", "n", "how the states move by themselves, sampled"),
        matrix("C", "p", "n", "how the outputs see the states"),
        matrix("G", "n", "g", "how the process noise moves the states"),
        samples("y", "k", "p", "the outputs, a row a sample, without Du"),
        or_zero(samples("added", "k", "n", "what the inputs add to the states after each, Bu")),
        optional(matrix("L", "n", "p", "the gain of a first, stable predictor")),
        or_first(
            choice("structure", "diagonal full", "whether the noises' entries are independent")),
        or_number(integer("lags", "the last of the autocovariances; 0: as the filter remembers"),
                  0.0)},
       {matrix("Q", "g", "g", "of the process noise, a sample; positive semidefinite"),
        matrix("R", "p", "p", "of the measurement noise, a sample; positive semidefinite"),
        matrix("Q_std", "g", "g", "standard errors of its entries"),
        matrix("R_std", "p", "p", "standard errors of its entries"),
        number("lags", "", "the last of the autocovariances"),
        number("misfit", "",
               "of the autocovariances, in standard errors; about 1 where all is right"),
        flag("at_boundary", "whether only the constraint keeps a covariance semidefinite"),
        number("optimality", "", "by how much a projected step still moves, relative"), condition},
       R"({"A": [[0.9]], "C": [[1]], "G": [[1]], "lags": 2, "y": [0.3, 1.1, 0.2, -0.9, -1.4, -0.6, -1.2, 0.4, 0.1, 0.8, 1.9, 0.7, 1.3, 0.2, -0.4, -1.1, -0.3, -0.8, 0.5, -0.2, 0.6, 1.4, 0.9, 0.3, -0.5, 0.1, -1.0, -0.7, 0.2, 0.8, 0.4, -0.1, -0.9, -0.3, 0.5, 1.2, 0.6, -0.4, 0.3, 0.9]})",
       &solve_noise_covariances},
      {"bayes",
       "a Gaussian vector after the measurement y = Cx + v: fusion and conditionals (9.3, 9.5)",
       {list("mean", "n", "", "E[x] before"),
        matrix("covariance", "n", "n", "of x before; it may be singular"),
        or_identity(matrix("C", "p", "n", "how the measurements see x")),
        or_zero(matrix("R", "p", "p", "covariance of v")), list("y", "p", "", "what was measured")},
       {list("mean", "n", "", "E[x | y]"), matrix("covariance", "n", "n", "of x given y"),
        number("squared_distance", "", "of y from what was expected, in its deviations"),
        number("log_evidence", "", "log p(y)")},
       R"({"mean": [2], "covariance": [[4]], "R": [[1]], "y": [5]})",
       &solve_bayes},
  };
}

}  // namespace flyball::solve
