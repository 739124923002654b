#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/expected.hpp>
#include <flyball/geometry/manifold.hpp>
#include <flyball/math/derivatives/dual.hpp>
#include <flyball/optimization/robust_loss.hpp>

/// Sums of squares of many residuals, each of few variables that live on manifolds: paths, maps,
/// calibrations.
namespace flyball::optimization {

/// Why there is no minimum.
enum class FactorGraphError {
  no_factors,      ///< Nothing to minimise.
  no_start,        ///< A residual or its derivative is not finite at the start.
  not_determined,  ///< Some variable can move without changing the cost.
};
[[nodiscard]] ErrorInfo error_info(FactorGraphError code);

/// When to stop.
struct FactorGraphOptions {
  int max_iterations = 100;  ///< Steps tried.
  /// The largest `FactorGraphResult::optimality` that is taken for an optimum.
  double tolerance = 1e-8;
};

/// Why the iteration ended.
enum class FactorGraphStop {
  optimal,          ///< The optimality is within its tolerance.
  rounding,         ///< No step lowers the cost by more than rounding.
  iteration_limit,  ///< The cap of the options.
};
[[nodiscard]] std::string_view to_string(FactorGraphStop stop);

/// How a minimisation ended.
struct FactorGraphResult {
  double cost = 0.0;        ///< Σ ρ(|r|²).
  double start_cost = 0.0;  ///< At the start.
  /// √(what the linearised problem could still gain / cost).
  double optimality = 0.0;
  FactorGraphStop stop = FactorGraphStop::iteration_limit;
  bool converged = false;            ///< optimal, or rounding with an optimality below 1e-3.
  int iterations = 0;                ///< Steps tried.
  int factorizations = 0;            ///< Sparse Cholesky decompositions.
  Eigen::Index unknowns = 0;         ///< Entries of all variables that are free.
  Eigen::Index factor_nonzeros = 0;  ///< Entries of the Cholesky factor: what a step costs.
};

namespace detail {

/// The graph as its solver sees it: sizes, and functions behind one indirection.
class GraphFunctions {
 public:
  virtual ~GraphFunctions() = default;

  /// A residual's place and shape.
  struct Shape {
    std::size_t first_link;  ///< Into `links`: the variables that it depends on.
    int count;               ///< How many.
    int rows;                ///< Entries of the residual.
    RobustLoss loss;         ///< Of its norm.
  };

  /// r and its Jacobian by all its variables' differences, side by side.
  /// @param J  rows x (sum of tangent sizes), column-major; null: r alone.
  virtual void evaluate(std::size_t factor, double* r, double* J) const noexcept = 0;
  /// All variables become what they were at the last `keep`, ⊕ the entries of the step.
  /// @param step  As many entries as `offsets` gives; fixed variables have none.
  virtual void move(const Eigen::VectorXd& step) noexcept = 0;
  virtual void keep() = 0;
  /// The values of a start, and back to them.
  virtual void keep_start() = 0;
  virtual void back_to_start() noexcept = 0;

  std::vector<Shape> factors{};
  std::vector<int> links{};     ///< Variables of the factors, one factor after the other.
  std::vector<int> sizes{};     ///< Tangent size of each variable; 0 where it is fixed.
  std::vector<int> tangents{};  ///< Tangent size of each variable, fixed or not.
  std::vector<int> offsets{};   ///< Where its entries begin in a step; set by the solver.

 protected:
  GraphFunctions() = default;
  GraphFunctions(const GraphFunctions&) = default;
  GraphFunctions& operator=(const GraphFunctions&) = default;
};

[[nodiscard]] Expected<FactorGraphResult> solve_graph(GraphFunctions& graph,
                                                      const FactorGraphOptions& options);
/// The blocks of (JᵀJ)⁻¹ on the diagonal, one a variable (empty where it is fixed).
[[nodiscard]] Expected<std::vector<Eigen::MatrixXd>> graph_covariances(GraphFunctions& graph);

/// The sum of the squares of what is computed now, losses included.
[[nodiscard]] double graph_cost(const GraphFunctions& graph);

template <class Scalar, class Point>
[[nodiscard]] auto cast_point(const Point& point) {
  if constexpr (flyball::detail::EigenVector<Point>) {
    return Eigen::Matrix<Scalar, Point::RowsAtCompileTime, 1>(point.template cast<Scalar>());
  } else {
    return point.template cast<Scalar>();
  }
}

}  // namespace detail

/// A variable of a FactorGraph.
template <Manifold Point>
struct Variable {
  int place = -1;  ///< Among all variables, in the order in which they were added.
};

/// Variables on manifolds and residuals between them; the minimum of Σ ρ(|r(x)|²) over all.
///
/// ```
/// FactorGraph<Pose2d, Eigen::Vector2d> graph;
/// const auto a = graph.add(Pose2d());
/// const auto b = graph.add(Pose2d(1.0, 0.0, 0.0));
/// graph.fix(a);
/// graph.add_factor([=](const auto& from, const auto& to) { return …; }, a, b);
/// const auto result = graph.solve();
/// const Pose2d moved = graph[b];
/// ```
///
/// A residual is a function of the values of its variables over a generic scalar, a vector of fixed
/// size in units of its standard deviations (whitened): Jacobians are exact, by dual numbers, with
/// respect to the local perturbation x ⊕ δ.
///
/// Points: the types of variables; Eigen vectors of fixed size, groups, bundles.
/// Source: Dellaert, Kaess, "Factor graphs for robot perception" (2017), chapters 2 and 3;
/// Hertzberg et al., "Integrating generic sensor fusion algorithms with sound state representations
/// through encapsulation of manifolds" (2013).
template <Manifold... Points>
class FactorGraph {
  static_assert(((tangent_size<Points> != Eigen::Dynamic) && ...), "variables have fixed sizes");

 public:
  FactorGraph() : functions_(std::make_unique<Functions>()) {}

  /// A variable that starts at `start`.
  template <Manifold Point>
  Variable<Point> add(const Point& start) {
    auto& of_kind = std::get<Kind<Point>>(functions_->kinds);
    const int place = static_cast<int>(functions_->sizes.size());
    functions_->places.push_back(of_kind.now.size());
    functions_->sizes.push_back(tangent_size<Point>);
    functions_->tangents.push_back(tangent_size<Point>);
    of_kind.now.push_back(start);
    of_kind.variables.push_back(place);
    return {place};
  }
  /// Keeps it where it is. Another graph's is left out, as by `set`.
  template <Manifold Point>
  void fix(Variable<Point> variable) {
    if (knows(variable)) {
      functions_->sizes[index(variable)] = 0;
    }
  }

  /// A residual r(x₁, …) of the variables, with a loss of its norm.
  /// @param residual  Over a generic scalar, a vector of fixed size, whitened.
  /// @param of  What `add` returned; with others `cost` is not a number and `solve` refuses.
  template <class Residual, Manifold... Of>
  void add_factor(Residual residual, RobustLoss loss, Variable<Of>... of) {
    using Made = Factor<Residual, Of...>;
    functions_->factors.push_back({functions_->links.size(), sizeof...(Of), Made::rows, loss});
    if (!(knows(of) && ...)) {
      (functions_->links.push_back(knows(of) ? of.place : -1), ...);
      functions_->residuals.push_back(nullptr);
      return;
    }
    (functions_->links.push_back(of.place), ...);
    functions_->residuals.push_back(std::make_unique<Made>(
        std::move(residual), std::array<std::size_t, sizeof...(Of)>{
                                 functions_->places[static_cast<std::size_t>(of.place)]...}));
  }
  template <class Residual, Manifold... Of>
  void add_factor(Residual residual, Variable<Of>... of) {
    add_factor(std::move(residual), RobustLoss{}, of...);
  }

  /// Its value now. @param variable  One of this graph's.
  template <Manifold Point>
  [[nodiscard]] const Point& operator[](Variable<Point> variable) const {
    return std::get<Kind<Point>>(functions_->kinds).now[functions_->places[index(variable)]];
  }
  /// Sets it, as a new start.
  template <Manifold Point>
  void set(Variable<Point> variable, const Point& value) {
    if (!knows(variable)) {
      return;
    }
    std::get<Kind<Point>>(functions_->kinds).now[functions_->places[index(variable)]] = value;
  }
  [[nodiscard]] std::size_t variables() const noexcept { return functions_->sizes.size(); }
  [[nodiscard]] std::size_t factors() const noexcept { return functions_->factors.size(); }

  /// Σ ρ(|r|²) at the values of now.
  [[nodiscard]] double cost() const { return detail::graph_cost(*functions_); }

  /// Moves the variables to a local minimum, by Levenberg and Marquardt's method on sparse normal
  /// equations; each damped step is one Cholesky decomposition in an order of least fill.
  /// @errors FactorGraphError::no_factors; no_start with the factor; not_determined with the
  ///         variable. The values are then those of the start.
  /// Cost: an iteration is linear in the factors, plus the decomposition: linear for paths. The
  /// normal equations lose what is below 1e-8 of the stiffest direction. Allocates.
  /// Source: Nielsen, "Damping parameter in Marquardt's method" (1999); Amestoy, Davis, Duff, "An
  /// approximate minimum degree ordering algorithm" (1996).
  [[nodiscard]] Expected<FactorGraphResult> solve(const FactorGraphOptions& options = {}) {
    return detail::solve_graph(*functions_, options);
  }

  /// The covariance of every variable's error x = x̂ ⊕ ξ at the values of now, the residuals being
  /// whitened by their true standard deviations; in the order of the variables, empty where fixed.
  /// @errors As `solve`. Cost: a decomposition and what of its inverse lies in the factor's
  /// pattern. Source: Takahashi, Fagan, Chen, "Formation of a sparse bus impedance matrix" (1973).
  [[nodiscard]] Expected<std::vector<Eigen::MatrixXd>> covariances() const {
    return detail::graph_covariances(*functions_);
  }

 private:
  template <class Point>
  struct Kind {
    std::vector<Point> now{};
    std::vector<Point> kept{};
    std::vector<Point> start{};
    std::vector<int> variables{};
  };
  using Kinds = std::tuple<Kind<Points>...>;

  struct AnyFactor {
    virtual ~AnyFactor() = default;
    virtual void evaluate(const Kinds& kinds, double* r, double* J) const noexcept = 0;
  };

  template <class Residual, class... Of>
  class Factor final : public AnyFactor {
   public:
    static constexpr int columns = (tangent_size<Of> + ...);
    static constexpr int rows = std::remove_cvref_t<decltype(std::declval<const Residual&>()(
        std::declval<const Of&>()...))>::RowsAtCompileTime;
    static_assert(rows > 0, "a residual has a fixed size");

    Factor(Residual residual, const std::array<std::size_t, sizeof...(Of)>& places)
        : residual_(std::move(residual)), places_(places) {}

    void evaluate(const Kinds& kinds, double* r, double* J) const noexcept override {
      at(kinds, r, J, std::index_sequence_for<Of...>{});
    }

   private:
    template <std::size_t... I>
    void at(const Kinds& kinds, double* r, double* J, std::index_sequence<I...>) const noexcept {
      Eigen::Map<Eigen::Matrix<double, rows, 1>> value(r);
      if (J == nullptr) {
        value = residual_(std::get<Kind<Of>>(kinds).now[places_[I]]...);
        return;
      }
      using Number = Dual<columns>;
      constexpr std::array<int, sizeof...(Of)> sizes{tangent_size<Of>...};
      std::array<int, sizeof...(Of)> begins{};
      for (std::size_t i = 1; i < sizeof...(Of); ++i) {
        begins[i] = begins[i - 1] + sizes[i - 1];
      }
      const Eigen::Matrix<Number, rows, 1> y =
          residual_(moved<Number>(std::get<Kind<Of>>(kinds).now[places_[I]], begins[I])...);
      Eigen::Map<Eigen::Matrix<double, rows, columns>> slope(J);
      for (int i = 0; i < rows; ++i) {
        value(i) = y(i).value;
        slope.row(i) = y(i).gradient.transpose();
      }
    }

    /// x ⊕ δ with the entries of δ as variables, at δ = 0.
    template <class Number, class Point>
    [[nodiscard]] static auto moved(const Point& point, int begin) {
      Eigen::Matrix<Number, tangent_size<Point>, 1> delta;
      for (int i = 0; i < tangent_size<Point>; ++i) {
        delta(i) = Number::variable(0.0, begin + i, columns);
      }
      return plus(detail::cast_point<Number>(point), delta);
    }

    Residual residual_;
    std::array<std::size_t, sizeof...(Of)> places_;
  };

  struct Functions final : detail::GraphFunctions {
    Kinds kinds{};
    std::vector<std::size_t> places{};  ///< Of each variable among those of its kind.
    std::vector<std::unique_ptr<AnyFactor>> residuals{};

    void evaluate(std::size_t factor, double* r, double* J) const noexcept override {
      residuals[factor]->evaluate(kinds, r, J);
    }
    void move(const Eigen::VectorXd& step) noexcept override {
      std::apply([&](auto&... kind) { (move_kind(kind, step), ...); }, kinds);
    }
    void keep() override {
      std::apply([](auto&... kind) { ((kind.kept = kind.now), ...); }, kinds);
    }
    void keep_start() override {
      std::apply([](auto&... kind) { ((kind.start = kind.now), ...); }, kinds);
    }
    void back_to_start() noexcept override {
      std::apply([](auto&... kind) { (kind.now.swap(kind.start), ...); }, kinds);
    }

   private:
    template <class Point>
    void move_kind(Kind<Point>& kind, const Eigen::VectorXd& step) noexcept {
      for (std::size_t i = 0; i < kind.now.size(); ++i) {
        const auto variable = static_cast<std::size_t>(kind.variables[i]);
        if (sizes[variable] > 0) {
          kind.now[i] =
              plus(kind.kept[i], step.template segment<tangent_size<Point>>(offsets[variable]));
        }
      }
    }
  };

  template <class Point>
  [[nodiscard]] bool knows(Variable<Point> variable) const noexcept {
    const std::vector<int>& of_kind = std::get<Kind<Point>>(functions_->kinds).variables;
    return variable.place >= 0 && index(variable) < functions_->places.size() &&
           functions_->places[index(variable)] < of_kind.size() &&
           of_kind[functions_->places[index(variable)]] == variable.place;
  }
  template <class Point>
  [[nodiscard]] static std::size_t index(Variable<Point> variable) noexcept {
    return static_cast<std::size_t>(variable.place);
  }

  std::unique_ptr<Functions> functions_;
};

}  // namespace flyball::optimization
