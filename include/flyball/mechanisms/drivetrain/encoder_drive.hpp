#pragma once

#include <flyball/mechanisms/drivetrain/pose_drive.hpp>

namespace flyball::mechanisms {

/// The model that an observer of a differential drive's pose has: the drive, the ways of its sides,
/// and what its voltages and its gyroscope seem to be off by,
///
///     x = [x (m), y (m), θ (rad), vl, vr (m/s), xl, xr (m), e_l, e_r (V), e_θ (m/s)],
///     u = [Vl, Vr] (V),  y = [θ, xl, xr],
///
///     dx/dt = v cos θ,  dy/dt = v sin θ,  dθ/dt = (vr - vl)/(2 r_b),  v = (vl + vr)/2,  (8.19)
///     d[vl, vr]/dt = A [vl, vr] + B (u + [e_l, e_r] - kS sgn [vl, vr]),
///     dxl/dt = vl + e_θ,  dxr/dt = vr - e_θ,                                            (8.20)
///     d[e_l, e_r, e_θ]/dt = 0.                                                          (8.21)
///
/// e_θ is the understeer of the encoders against the gyroscope: what the left side's way grows by
/// that turns nothing. Its parameters are those of PoseDrive. Made by `encoder_drive`.
///
/// Process noise: of e_l and e_r how much the voltages drop, of e_θ the slip of the wheels.
/// Source: book, section 8.7.6, equations (8.17) to (8.21).
class EncoderDrive {
 public:
  /// Where its states are.
  enum State : int {
    x_at,
    y_at,
    heading_at,
    vl_at,
    vr_at,
    xl_at,
    xr_at,
    e_l_at,
    e_r_at,
    e_heading_at
  };

  /// The size of x.
  static constexpr int states() { return 10; }
  /// The size of u.
  static constexpr int inputs() { return 2; }

  /// Of numbers that are known to be good; `encoder_drive` checks them. @param trackwidth  m.
  EncoderDrive(const DifferentialDrive& drive, double trackwidth) noexcept
      : p_(detail::drive_parameters_of(drive, trackwidth)) {}

  /// 2 r_b, m.
  [[nodiscard]] double trackwidth() const noexcept { return p_(detail::trackwidth_at); }
  /// [trackwidth, kS_left, kS_right, A row by row, B row by row].
  [[nodiscard]] const detail::DriveParameters& parameters() const noexcept { return p_; }

  /// dx/dt over a generic scalar. @param x  10 x 1. @param u  2 x 1. @param p  The parameters.
  template <class X, class U, class P>
  [[nodiscard]] auto derivative(const X& x, const U& u, const P& p) const {
    using std::cos;
    using std::sin;
    using Scalar = ScalarOf<X, U, P>;
    const Scalar vl = x(vl_at);
    const Scalar vr = x(vr_at);
    const Scalar v = 0.5 * (vl + vr);
    const Eigen::Vector<Scalar, 2> dv = detail::side_accelerations<Scalar>(
        vl, vr, Scalar(u(0) + x(e_l_at)), Scalar(u(1) + x(e_r_at)), p);
    Eigen::Vector<Scalar, 10> rate;
    rate << Scalar(v * cos(Scalar(x(heading_at)))), Scalar(v * sin(Scalar(x(heading_at)))),
        Scalar((vr - vl) / p(detail::trackwidth_at)), dv(0), dv(1), Scalar(vl + x(e_heading_at)),
        Scalar(vr - x(e_heading_at)), Scalar(0.0), Scalar(0.0), Scalar(0.0);
    return rate;
  }
  /// The same with its own parameters.
  template <class X, class U>
  [[nodiscard]] auto derivative(const X& x, const U& u) const {
    return derivative(x, u, p_);
  }
  /// [θ, xl, xr]: a gyroscope and the encoders.
  template <class X, class U>
  [[nodiscard]] auto output(const X& x, const U&) const {
    return Eigen::Vector<ScalarOf<X, U>, 3>{x(heading_at), x(xl_at), x(xr_at)};
  }
  /// ∂f/∂x (10 x 10) and ∂f/∂u (10 x 2), in closed form. No allocation.
  template <class X, class U, class Am, class Bm>
  void jacobians(const X& x, const U& u, Am&& A, Bm&& B) const {
    jacobians(x, u, p_, A, B);
  }
  /// The same for given parameters.
  template <class X, class U, class P, class Am, class Bm>
  void jacobians(const X& x, const U& /*u*/, const P& p, Am&& A, Bm&& B) const {
    using detail::A_at, detail::B_at, detail::trackwidth_at;
    const double c = std::cos(x(heading_at));
    const double s = std::sin(x(heading_at));
    const double v = 0.5 * (x(vl_at) + x(vr_at));
    const double turn = 1.0 / p(trackwidth_at);
    A.setZero();
    B.setZero();
    A(x_at, heading_at) = -v * s;
    A(y_at, heading_at) = v * c;
    A(x_at, vl_at) = A(x_at, vr_at) = 0.5 * c;
    A(y_at, vl_at) = A(y_at, vr_at) = 0.5 * s;
    A(heading_at, vl_at) = -turn;
    A(heading_at, vr_at) = turn;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        A(vl_at + i, vl_at + j) = p(A_at + 2 * i + j);
        A(vl_at + i, e_l_at + j) = B(vl_at + i, j) = p(B_at + 2 * i + j);
      }
    }
    A(xl_at, vl_at) = A(xr_at, vr_at) = 1.0;
    A(xl_at, e_heading_at) = 1.0;
    A(xr_at, e_heading_at) = -1.0;
  }
  /// C (3 x 10) and D = 0 (3 x 2).
  template <class X, class U, class Cm, class Dm>
  void output_jacobians(const X&, const U&, Cm&& C, Dm&& D) const {
    C.setZero();
    D.setZero();
    C(0, heading_at) = C(1, xl_at) = C(2, xr_at) = 1.0;
  }
  /// The same for given parameters, on which it does not depend.
  template <class X, class U, class P, class Cm, class Dm>
  void output_jacobians(const X& x, const U& u, const P&, Cm&& C, Dm&& D) const {
    output_jacobians(x, u, C, D);
  }
  /// Names and units; θ is an angle, as state and as output.
  [[nodiscard]] ModelDescription description() const;

  /// K_error of (8.22), 2 x 3: the voltage errors are added to the sides' voltages (in
  /// u = K(r - x) with r = 0, they are taken from them), the heading's error to none.
  [[nodiscard]] static Eigen::Matrix<double, 2, 3> error_gain() {
    return Eigen::Matrix<double, 2, 3>::Identity();
  }

 private:
  detail::DriveParameters p_;
};

/// @errors ArgumentError::not_positive, not_finite for the trackwidth; as `check_system` for the
/// drive. Source: book, section 8.7.6.
[[nodiscard]] Expected<EncoderDrive> encoder_drive(const DifferentialDrive& drive,
                                                   Length trackwidth);
/// Of motors and geometry. @errors As `differential_drive`.
[[nodiscard]] Expected<EncoderDrive> encoder_drive(const DifferentialDriveParameters& parameters);
/// Of identified gains. @errors As `differential_drive`, and for the trackwidth.
[[nodiscard]] Expected<EncoderDrive> encoder_drive(const DriveGains& gains, Length trackwidth);

/// The drive with the ways of its sides: x = [vl, vr, xl, xr], u = [Vl, Vr], y = [xl, xr].
/// @errors As `check_system`. Source: book, equations (8.17), (8.18).
[[nodiscard]] Expected<ContinuousSystem<4, 2, 2>> encoder_positions_drive(
    const DifferentialDrive& drive);

}  // namespace flyball::mechanisms
