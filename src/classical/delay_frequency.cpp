#include <algorithm>
#include <utility>

#include <flyball/classical/delay_poles.hpp>
#include <flyball/classical/frequency_response.hpp>

#include "classical/delay_frequency.hpp"
#include "core/constants.hpp"
#include "math/dense/dense.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

class DelaySource final : public FrequencyResponse::Source {
 public:
  DelaySource(DelaySystem system, const VectorXcd& rightmost) : system_(std::move(system)) {
    VectorXcd own = flyball::detail::eigenvalues_of(system_.form().A);
    const VectorXd& delays = system_.delays();
    hints_.places.resize(own.size() + rightmost.size() + delays.size());
    hints_.places << own, rightmost, -delays.cwiseInverse().cast<Complex>();
    if (system_.period()) {
      for (Complex& place : hints_.places.head(own.size() + rightmost.size())) {
        place = place == 0.0 ? Complex(-1.0 / system_.period()->si())
                             : std::log(place) / system_.period()->si();
      }
    }
    hints_.delay = delays.size() > 0 ? delays.maxCoeff() : 0.0;
  }

  [[nodiscard]] Index outputs() const override { return system_.outputs(); }
  [[nodiscard]] Index inputs() const override { return system_.inputs(); }
  [[nodiscard]] std::optional<Time> period() const override { return system_.period(); }
  void evaluate(const VectorXd& frequencies, Complex* values) const override {
    const Index entries = outputs() * inputs();
    for (Index i = 0; i < frequencies.size(); ++i) {
      Eigen::Map<MatrixXcd>(values + i * entries, outputs(), inputs()) =
          system_.response(frequencies(i));
    }
  }
  [[nodiscard]] MatrixXcd at_point(Complex s) const override {
    const auto value = system_.at(system_.period() ? std::exp(s * system_.period()->si()) : s);
    return value ? *value : MatrixXcd(MatrixXcd::Constant(outputs(), inputs(), Complex(nan, nan)));
  }
  [[nodiscard]] Hints hints() const override { return hints_; }

 private:
  DelaySystem system_;
  Hints hints_;
};

}  // namespace

FrequencyResponse detail::response_with(const DelaySystem& system, const VectorXcd& rightmost) {
  return FrequencyResponse(std::make_shared<DelaySource>(system, rightmost));
}

Expected<FrequencyResponse> frequency_response(const DelaySystem& system) {
  VectorXcd rightmost;
  if (!system.period() && system.has_delay_in_loop()) {
    if (const auto found = rightmost_poles(system)) {
      rightmost = found->poles;
    }
  }
  return detail::response_with(system, rightmost);
}

}  // namespace flyball::classical
