#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <flyball/core/random.hpp>

namespace flyball::test {

[[nodiscard]] Eigen::MatrixXd scalar(double value);
/// Independent standard normal entries.
[[nodiscard]] Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows,
                                            Eigen::Index columns);
[[nodiscard]] Eigen::MatrixXd random_rotation(Random& random, Eigen::Index n);
/// Powers of ten between 10^-decades and 10^decades.
[[nodiscard]] Eigen::VectorXd random_scales(Random& random, Eigen::Index n, double decades);
/// The nearest powers of two: to be scaled by them rounds nothing.
[[nodiscard]] Eigen::VectorXd random_units(Random& random, Eigen::Index n, double decades);

/// What every kernel is tried on.
enum class SystemClass {
  stable,                 ///< Decaying, down to 1e-3 of ‖A‖ beside the boundary.
  unstable,               ///< Some modes grow.
  badly_scaled,           ///< Either of them in units of 1e±8.
  nearly_uncontrollable,  ///< One mode or two hang on 1e-2 to 1e-7 of the inputs.
  reference,              ///< The Riccati benchmarks of tests/data, turned and in units of 1e±8.
};
inline constexpr SystemClass all_classes[] = {
    SystemClass::stable, SystemClass::unstable, SystemClass::badly_scaled,
    SystemClass::nearly_uncontrollable, SystemClass::reference};
[[nodiscard]] const char* to_string(SystemClass kind);

/// The plane in which a system's poles lie: continuous or discrete.
enum class Plane { s, z };

/// dx = A x + B u, y = C x + D u with the cost weights [Q N; Nᵀ R].
struct RandomSystem {
  SystemClass kind = SystemClass::stable;
  std::string name;            ///< Of a reference case.
  Eigen::MatrixXd A, B, C, D;  ///< n x n, n x m, p x n, p x m.
  Eigen::MatrixXd Q, R, N;     ///< Positive semidefinite together, R regular; reference: as given.
  Eigen::VectorXd states, inputs, outputs;  ///< Units, powers of two; ones if well scaled.
  double coupling = 1.0;                    ///< Size of what connects the weak modes to the inputs.
  Eigen::Index weak_modes = 0;              ///< How many hang on it.
};

/// The same in the units x = diag(states) x', u = diag(inputs) u', y = diag(outputs) y'.
[[nodiscard]] RandomSystem rescaled(const RandomSystem& s, const Eigen::VectorXd& states,
                                    const Eigen::VectorXd& inputs, const Eigen::VectorXd& outputs);
/// The same in the axes x = U x' for an orthogonal U.
[[nodiscard]] RandomSystem turned(const RandomSystem& s, const Eigen::MatrixXd& U);
/// The same without its units; nothing is rounded.
[[nodiscard]] RandomSystem plain(const RandomSystem& s);

/// An endless sequence of systems, the classes by turns; the same for the same seed.
class RandomSystems {
 public:
  /// @param most_states  The largest n; 5 or more.
  RandomSystems(std::uint64_t seed, Plane plane, Eigen::Index most_states = 6);

  RandomSystem next();
  RandomSystem next(SystemClass kind);
  /// With every pole inside the boundary, whatever the class.
  RandomSystem next_stable();
  [[nodiscard]] Random& random() { return random_; }

 private:
  RandomSystem well_scaled(bool stable);
  RandomSystem weakly_coupled();
  RandomSystem reference();
  void move_poles(Eigen::MatrixXd& A, bool stable);
  void add_cost(RandomSystem& s);

  Random random_;
  Plane plane_;
  Eigen::Index most_states_;
  std::vector<RandomSystem> references_;
  std::uint64_t count_ = 0;
};

}  // namespace flyball::test
