#include <flyball/classical/frequency_response.hpp>

#include <cmath>
#include <tuple>
#include <utility>

#include "classical/state_space_response.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

class TransferSource final : public FrequencyResponse::Source {
 public:
  TransferSource(TransferFunction transfer, Factors factors)
      : transfer_(std::move(transfer)), factors_(std::move(factors)) {}

  [[nodiscard]] Index outputs() const override { return 1; }
  [[nodiscard]] Index inputs() const override { return 1; }
  [[nodiscard]] std::optional<Time> period() const override { return transfer_.period(); }
  void evaluate(const VectorXd& frequencies, Complex* values) const override {
    for (Index k = 0; k < frequencies.size(); ++k) {
      values[k] = transfer_.response(frequencies(k));
    }
  }
  [[nodiscard]] MatrixXcd at_point(Complex s) const override {
    const auto value =
        transfer_.at(transfer_.period() ? std::exp(s * transfer_.period()->si()) : s);
    return MatrixXcd::Constant(1, 1, value.value_or(Complex(nan, nan)));
  }
  [[nodiscard]] std::optional<Factors> factors(Index /*output*/, Index /*input*/) const override {
    return factors_;
  }

 private:
  TransferFunction transfer_;
  Factors factors_;
};

/// One entry of a matrix.
class EntrySource final : public FrequencyResponse::Source {
 public:
  EntrySource(FrequencyResponse whole, Index output, Index input)
      : whole_(std::move(whole)), output_(output), input_(input) {}

  [[nodiscard]] Index outputs() const override { return 1; }
  [[nodiscard]] Index inputs() const override { return 1; }
  [[nodiscard]] std::optional<Time> period() const override { return whole_.period(); }
  void evaluate(const VectorXd& frequencies, Complex* values) const override {
    if (const auto all = whole_.sample(frequencies)) {
      Eigen::Map<VectorXcd>(values, frequencies.size()) =
          all->row(output_ + input_ * whole_.outputs()).transpose();
    }
  }
  [[nodiscard]] MatrixXcd at_point(Complex s) const override {
    return whole_.at_point(s).block(output_, input_, 1, 1);
  }
  [[nodiscard]] std::optional<Factors> factors(Index /*output*/, Index /*input*/) const override {
    return whole_.factors(output_, input_);
  }
  [[nodiscard]] Hints hints() const override { return whole_.hints(); }
  [[nodiscard]] VectorXd known_frequencies() const override { return whole_.known_frequencies(); }

 private:
  FrequencyResponse whole_;
  Index output_;
  Index input_;
};

/// How far a root moves when the coefficients of its polynomial move by their last digit: the δ of
/// Σ |p⁽ᵐ⁾(r)|/m! δᵐ = ε Σ |cₖ rᵏ| is at most the smallest of its terms' own.
double uncertainty(const VectorXd& p, Complex root) {
  const Index n = p.size() - 1;
  VectorXcd shifted = p.cast<Complex>();  // p(r + x), by repeated synthetic division
  for (Index from = 0; from < n; ++from) {
    for (Index i = 1; i <= n - from; ++i) {
      shifted(i) += root * shifted(i - 1);
    }
  }
  double size = 0.0;
  for (Index i = 0; i <= n; ++i) {
    size = size * std::abs(root) + std::abs(p(i));
  }
  double least = std::numeric_limits<double>::infinity();
  for (Index m = 1; m <= n; ++m) {
    const double slope = std::abs(shifted(n - m));
    if (slope > 0.0) {
      least = std::min(least, std::pow(epsilon * size / slope, 1.0 / static_cast<double>(m)));
    }
  }
  return least;
}

/// Roots that the coefficients cannot tell from the axis are on it, those at z = 1 are there.
VectorXcd settled(VectorXcd roots, const VectorXd& p, bool discrete) {
  for (Complex& root : roots) {
    const double blur = uncertainty(p, root);
    if (!discrete) {
      root.real(std::abs(root.real()) <= blur ? 0.0 : root.real());
    } else if (std::abs(root - 1.0) <= blur) {
      root = 1.0;
    } else if (std::abs(std::abs(root) - 1.0) <= blur) {
      root /= std::abs(root);
    }
  }
  return roots;
}

}  // namespace

std::optional<Factors> FrequencyResponse::Source::factors(Index /*output*/, Index /*input*/) const {
  return std::nullopt;
}

FrequencyResponse::Source::Hints FrequencyResponse::Source::hints() const {
  return {};
}

VectorXd FrequencyResponse::Source::known_frequencies() const {
  return {};
}

double FrequencyResponse::highest_frequency() const {
  const auto T = period();
  return T ? std::numbers::pi / T->si() : std::numeric_limits<double>::infinity();
}

MatrixXcd FrequencyResponse::at(double frequency) const {
  MatrixXcd G(outputs(), inputs());
  source_->evaluate(VectorXd::Constant(1, frequency), G.data());
  return G;
}

Expected<MatrixXcd> FrequencyResponse::sample(const VectorXd& frequencies) const {
  constexpr std::string_view where = "frequency response";
  FLYBALL_CHECK(check_finite(MatrixXd(frequencies), where, "the frequencies"));
  const double most = frequencies.size() == 0 ? 0.0 : frequencies.cwiseAbs().maxCoeff();
  if (most > highest_frequency() * (1.0 + 1e-12)) {
    return refusal(ArgumentError::out_of_range, where, "a frequency")
        .got(flyball::detail::format("{} rad/s", most))
        .expected(flyball::detail::format("up to pi/T, {} rad/s: a sampled system has none beyond",
                                          highest_frequency()));
  }
  const VectorXd known = known_frequencies();
  if (known.size() > 0 && frequencies.size() > 0 &&
      (frequencies.minCoeff() < known(0) || frequencies.maxCoeff() > known(known.size() - 1))) {
    return refusal(ArgumentError::out_of_range, where, "a frequency")
        .got(flyball::detail::format("{} rad/s", frequencies.minCoeff() < known(0)
                                                     ? frequencies.minCoeff()
                                                     : frequencies.maxCoeff()))
        .expected(flyball::detail::format("within the data, {} to {} rad/s", known(0),
                                          known(known.size() - 1)));
  }
  MatrixXcd values(outputs() * inputs(), frequencies.size());
  source_->evaluate(frequencies, values.data());
  return values;
}

Expected<FrequencyResponse> FrequencyResponse::entry(Index output, Index input) const {
  constexpr std::string_view where = "frequency response";
  for (const auto& [index, count, name] :
       {std::tuple<Index, Index, const char*>{output, outputs(), "the output"},
        {input, inputs(), "the input"}}) {
    if (index < 0 || index >= count) {
      return refusal(ArgumentError::out_of_range, where, name)
          .got(flyball::detail::format("{}", index))
          .expected(flyball::detail::format("from 0 to {}", count - 1));
    }
  }
  return outputs() * inputs() == 1
             ? *this
             : FrequencyResponse(std::make_shared<EntrySource>(*this, output, input));
}

Expected<FrequencyResponse> frequency_response(const TransferFunction& transfer) {
  Factors factors;
  FLYBALL_TRY(factors.zeros, transfer.zeros());
  FLYBALL_TRY(factors.poles, transfer.poles());
  const bool discrete = transfer.period().has_value();
  factors.zeros = settled(factors.zeros, transfer.num(), discrete);
  factors.poles = settled(factors.poles, transfer.den(), discrete);
  factors.gain = transfer.num()(0) / transfer.den()(0);
  factors.delay = transfer.delay();
  return FrequencyResponse(std::make_shared<TransferSource>(transfer, std::move(factors)));
}

Expected<FrequencyResponse> frequency_response(const ContinuousSystem<>& system, Time delay) {
  constexpr std::string_view where = "frequency response";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  FLYBALL_CHECK(check_not_negative(delay.si(), where, "delay", "s"));
  return FrequencyResponse(detail::state_space_source(system, std::nullopt, delay.si()));
}

Expected<FrequencyResponse> frequency_response(const DiscreteSystem<>& system, Time delay) {
  constexpr std::string_view where = "frequency response";
  FLYBALL_CHECK(check_system_or_gain(system, where));
  FLYBALL_CHECK(check_not_negative(delay.si(), where, "delay", "s"));
  return FrequencyResponse(detail::state_space_source({system.A, system.B, system.C, system.D},
                                                      system.period, delay.si()));
}

}  // namespace flyball::classical
