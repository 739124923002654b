#pragma once

#include <cmath>

#include <flyball/mechanisms/differential_drive.hpp>
#include <flyball/systems/model.hpp>

namespace flyball::mechanisms {

namespace detail {

/// Where the numbers of a differential drive stand among a pose model's parameters.
enum DriveParameter : int {
  trackwidth_at = 0,
  kS_left_at = 1,
  kS_right_at = 2,
  A_at = 3,  ///< Four entries, row by row.
  B_at = 7,  ///< Likewise.
  drive_parameters = 11
};

using DriveParameters = Eigen::Vector<double, drive_parameters>;

[[nodiscard]] DriveParameters drive_parameters_of(const DifferentialDrive& drive,
                                                  double trackwidth) noexcept;
[[nodiscard]] std::vector<Parameter> describe_drive_parameters(const DriveParameters& values);

/// d[vl, vr]/dt = A v + B (u - kS sgn v), over a generic scalar, with the numbers of `p`.
template <class Scalar, class P>
[[nodiscard]] Eigen::Vector<Scalar, 2> side_accelerations(const Scalar& vl, const Scalar& vr,
                                                          const Scalar& Vl, const Scalar& Vr,
                                                          const P& p) {
  const Scalar left = Vl - friction_voltage(Scalar(p(kS_left_at)), vl);
  const Scalar right = Vr - friction_voltage(Scalar(p(kS_right_at)), vr);
  return {
      p(A_at) * vl + p(A_at + 1) * vr + p(B_at) * left + p(B_at + 1) * right,
      p(A_at + 2) * vl + p(A_at + 3) * vr + p(B_at + 2) * left + p(B_at + 3) * right,
  };
}

}  // namespace detail

/// A differential drive with its place on the field: x = y = [x (m), y (m), θ (rad), vl (m/s),
/// vr (m/s)], u = [Vl (V), Vr (V)],
///
///     dx/dt = v cos θ,  dy/dt = v sin θ,  dθ/dt = (vr - vl)/(2 r_b),  v = (vl + vr)/2,
///     d[vl, vr]/dt = A [vl, vr] + B (u - kS sgn [vl, vr])
///
/// with the drive's A and B: of motors and geometry (Theorem 8.7.1), or identified (Theorem
/// 14.4.1). Its parameters are the trackwidth 2 r_b, kS and the entries of A and B. Made by
/// `pose_drive`.
///
/// The linear time-varying model of Theorem 8.7.3 is its Jacobians at the state, that of Theorem
/// 8.7.4 (the cross-track controller's) those at the state with θ = 0.
/// Source: book, section 8.7.3, equation (8.11).
class PoseDrive {
 public:
  /// The size of x.
  static constexpr int states() { return 5; }
  /// The size of u.
  static constexpr int inputs() { return 2; }

  /// Of numbers that are known to be good; `pose_drive` checks them. @param trackwidth  m.
  PoseDrive(const DifferentialDrive& drive, double trackwidth) noexcept
      : p_(detail::drive_parameters_of(drive, trackwidth)) {}

  /// 2 r_b, m.
  [[nodiscard]] double trackwidth() const noexcept { return p_(detail::trackwidth_at); }
  /// [trackwidth, kS_left, kS_right, A row by row, B row by row].
  [[nodiscard]] const detail::DriveParameters& parameters() const noexcept { return p_; }

  /// dx/dt over a generic scalar. @param x  5 x 1. @param u  2 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const Scalar vl = x(3);
    const Scalar vr = x(4);
    const Scalar v = 0.5 * (vl + vr);
    const Eigen::Vector<Scalar, 2> dv =
        detail::side_accelerations<Scalar>(vl, vr, Scalar(u(0)), Scalar(u(1)), p);
    return Eigen::Vector<Scalar, 5>{v * cos(Scalar(x(2))), v * sin(Scalar(x(2))),
                                    (vr - vl) / p(detail::trackwidth_at), dv(0), dv(1)};
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// A of (8.12) and B of (8.13). @param x  5 x 1. @param A  5 x 5. @param B  5 x 2.
  /// Cost: a sine and a cosine; no allocation.
  template <class X, class U, class Am, class Bm>
  void jacobians(const X& x, const U& u, Am&& A, Bm&& B) const {
    jacobians(x, u, p_, A, B);
  }
  /// The same for given parameters.
  template <class X, class U, class P, class Am, class Bm>
  void jacobians(const X& x, const U& /*u*/, const P& p, Am&& A, Bm&& B) const {
    using detail::A_at, detail::B_at, detail::trackwidth_at;
    const double c = std::cos(x(2));
    const double s = std::sin(x(2));
    const double v = 0.5 * (x(3) + x(4));
    const double turn = 1.0 / p(trackwidth_at);
    A.setZero();
    B.setZero();
    A(0, 2) = -v * s;
    A(1, 2) = v * c;
    A(0, 3) = A(0, 4) = 0.5 * c;
    A(1, 3) = A(1, 4) = 0.5 * s;
    A(2, 3) = -turn;
    A(2, 4) = turn;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        A(3 + i, 3 + j) = p(A_at + 2 * i + j);
        B(3 + i, j) = p(B_at + 2 * i + j);
      }
    }
  }
  /// Names and units; θ is an angle.
  [[nodiscard]] ModelDescription description() const;

 private:
  detail::DriveParameters p_;
};

/// @param trackwidth  2 r_b, between the sides' wheels; of a skid-steer drive the one that its
/// rotations show. @errors ArgumentError::not_positive, not_finite for the trackwidth; as
/// `check_system` for the drive. Source: book, Theorem 8.7.3.
[[nodiscard]] Expected<PoseDrive> pose_drive(const DifferentialDrive& drive, Length trackwidth);
/// Of motors and geometry. @errors As `differential_drive`.
[[nodiscard]] Expected<PoseDrive> pose_drive(const DifferentialDriveParameters& parameters);
/// Of identified gains. @errors As `differential_drive`, and for the trackwidth.
[[nodiscard]] Expected<PoseDrive> pose_drive(const DriveGains& gains, Length trackwidth);

}  // namespace flyball::mechanisms
