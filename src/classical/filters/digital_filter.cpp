#include <flyball/classical/filters/digital_filter.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <flyball/classical/filters/room.hpp>
#include <flyball/core/signal.hpp>

#include "classical/filters/root_sections.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

/// Re(1/(1 - r e^{-jθ})), samples of delay that a pole adds: ½ + ½(1 - |r|²)/|1 - r e^{-jθ}|².
double root_delay(Complex root, Complex inverse) {
  const double room = (1.0 - std::abs(root)) * (1.0 + std::abs(root));
  const double distance = std::norm(1.0 - root * inverse);
  // A zero on the circle turns the phase at once; beside it, it delays by half a sample.
  return std::abs(room) < 1e-15 ? 0.5 : 0.5 + 0.5 * room / distance;
}

Expected<void> check_inside(const VectorXcd& poles, std::string_view where) {
  for (const Complex pole : poles) {
    if (!(std::abs(pole) < 1.0)) {
      return refusal(ArgumentError::out_of_range, where, "a pole")
          .got(format_number(pole.real()) + (pole.imag() != 0.0 ? " + " : "") +
               (pole.imag() != 0.0 ? format_number(pole.imag()) + "j" : ""))
          .expected("inside the unit circle, for the filter to be stable")
          .with("magnitude", std::abs(pole));
    }
  }
  return {};
}

Expected<void> check_signal(const MatrixRef& x, Index least, std::string_view where) {
  return Checks(where)
      .also([&]() -> Expected<void> {
        if (x.size() == 0) {
          return refusal(ArgumentError::empty, where, "x").expected("samples x 1");
        }
        if (x.rows() < least) {
          return refusal(ArgumentError::out_of_range, where, "x")
              .got(std::to_string(x.rows()) + " samples")
              .expected("at least " + std::to_string(least));
        }
        return {};
      })
      .shape(x, x.rows(), 1, "x", "samples x 1")
      .finite(x, "x");
}

/// Sections with their states, as many as there are.
class Cascade {
 public:
  explicit Cascade(std::span<const Biquad> sections)
      : sections_(sections), states_(2 * sections.size(), 0.0) {}

  void start(double x) {
    for (std::size_t i = 0; i < sections_.size(); ++i) {
      const Biquad& c = sections_[i];
      const double y = x * ((c.b0 + c.b1 + c.b2) / ((1.0 + c.a1) + c.a2));
      states_[2 * i] = y - c.b0 * x;
      states_[2 * i + 1] = c.b2 * x - c.a2 * y;
      x = y;
    }
  }

  double operator()(double x) {
    for (std::size_t i = 0; i < sections_.size(); ++i) {
      const Biquad& c = sections_[i];
      const double y = c.b0 * x + states_[2 * i];
      states_[2 * i] = c.b1 * x - c.a1 * y + states_[2 * i + 1];
      states_[2 * i + 1] = c.b2 * x - c.a2 * y;
      x = y;
    }
    return x;
  }

 private:
  std::span<const Biquad> sections_;
  std::vector<double> states_;
};

}  // namespace

Complex DigitalFilter::response(double frequency) const {
  return detail::root_quotient(zeros, poles, gain, std::polar(1.0, frequency * period.si()));
}

double DigitalFilter::group_delay(double frequency) const {
  const Complex inverse = std::polar(1.0, -frequency * period.si());
  // Roots at zero, as many as are missing for as many zeros as poles.
  double samples = static_cast<double>(poles.size() - zeros.size());
  for (const Complex pole : poles) {
    samples += root_delay(pole, inverse) - 1.0;
  }
  for (const Complex zero : zeros) {
    samples -= root_delay(zero, inverse) - 1.0;
  }
  return samples * period.si();
}

Expected<DigitalFilter> make_filter(const VectorXcd& zeros, const VectorXcd& poles, double gain,
                                    Time period, double reference) {
  constexpr std::string_view where = "make_filter";
  FLYBALL_CHECK(Checks(where)
                    .positive(period.si(), "period", "s")
                    .finite(gain, "gain")
                    .finite(reference, "reference")
                    .finite(zeros.real(), "zeros")
                    .finite(zeros.imag(), "zeros")
                    .finite(poles.real(), "poles")
                    .finite(poles.imag(), "poles"));
  if (zeros.size() > poles.size()) {
    return refusal(ArgumentError::wrong_shape, where, "zeros")
        .got(std::to_string(zeros.size()))
        .expected("at most as many as poles, which are " + std::to_string(poles.size()));
  }
  FLYBALL_CHECK(check_inside(poles, where));
  const Complex at = std::polar(1.0, reference * period.si());
  for (const Complex zero : zeros) {
    if (std::abs(at - zero) < 1e-12) {
      return refusal(ArgumentError::malformed, where, "reference")
          .got("at a zero")
          .expected("a frequency at which the filter has a gain");
    }
  }
  FLYBALL_TRY(std::vector<Biquad> sections, detail::paired_sections(zeros, poles, where));
  const double wanted = std::abs(detail::root_quotient(zeros, poles, gain, at));
  detail::set_gains(sections, std::copysign(wanted, gain), reference * period.si());
  return DigitalFilter{zeros, poles, gain, std::move(sections), period};
}

Complex section_response(std::span<const Biquad> sections, double angle) {
  const Complex back = std::polar(1.0, -angle);  // z⁻¹
  Complex product = 1.0;
  for (const Biquad& c : sections) {
    product *= (c.b0 + back * (c.b1 + back * c.b2)) / (1.0 + back * (c.a1 + back * c.a2));
  }
  return product;
}

Expected<void> check_sections(std::span<const Biquad> sections, std::string_view where) {
  if (sections.empty()) {
    return refusal(ArgumentError::empty, where, "sections").expected("one at least");
  }
  for (const Biquad& c : sections) {
    for (const double coefficient : {c.b0, c.b1, c.b2, c.a1, c.a2}) {
      if (!is_signal(coefficient)) {
        return refusal(ArgumentError::not_finite, where, "a coefficient")
            .got(format_number(coefficient))
            .expected("finite, and not above 1e100");
      }
    }
    // Jury: z² + a1 z + a2 has both roots inside the circle.
    if (!(std::abs(c.a2) < 1.0 && std::abs(c.a1) < 1.0 + c.a2)) {
      return refusal(ArgumentError::out_of_range, where, "a section")
          .got("unstable")
          .expected("one with |a2| < 1 and |a1| < 1 + a2")
          .with("a1", c.a1)
          .with("a2", c.a2);
    }
  }
  return {};
}

Expected<VectorXd> filter_signal(std::span<const Biquad> sections, const MatrixRef& x,
                                 FilterStart start) {
  constexpr std::string_view where = "filter_signal";
  FLYBALL_CHECK(check_sections(sections, where));
  FLYBALL_CHECK(check_signal(x, 1, where));
  Cascade filter(sections);
  if (start == FilterStart::steady) {
    filter.start(x(0, 0));
  }
  VectorXd y(x.rows());
  for (Index k = 0; k < x.rows(); ++k) {
    y(k) = filter(x(k, 0));
  }
  return y;
}

Expected<VectorXd> filter_zero_phase(std::span<const Biquad> sections, const MatrixRef& x) {
  constexpr std::string_view where = "filter_zero_phase";
  FLYBALL_CHECK(check_sections(sections, where));
  FLYBALL_CHECK(check_signal(x, 2, where));
  // Coefficients, without those that a last section of first order does not have.
  const auto none = [&](auto member) { return std::ranges::count(sections, 0.0, member); };
  const auto coefficients = static_cast<Index>(2 * sections.size() + 1) -
                            std::min<Index>(none(&Biquad::b2), none(&Biquad::a2));
  const Index n = x.rows();
  const Index edge = std::min<Index>(3 * coefficients, n - 1);
  VectorXd padded(n + 2 * edge);
  for (Index k = 0; k < edge; ++k) {
    padded(k) = 2.0 * x(0, 0) - x(edge - k, 0);
    padded(edge + n + k) = 2.0 * x(n - 1, 0) - x(n - 2 - k, 0);
  }
  padded.segment(edge, n) = x.col(0);
  for (int way = 0; way < 2; ++way) {
    Cascade filter(sections);
    filter.start(padded(0));
    for (double& value : padded) {
      value = filter(value);
    }
    padded.reverseInPlace();
  }
  return VectorXd(padded.segment(edge, n));
}

namespace detail {

Expected<void> check_room(std::size_t count, std::size_t room, std::string_view where,
                          std::string_view what) {
  if (count <= room) {
    return {};
  }
  return refusal(ArgumentError::wrong_shape, where, what)
      .got(std::to_string(count))
      .expected("at most " + std::to_string(room) + ", for which it has room");
}

}  // namespace detail

}  // namespace flyball::classical
