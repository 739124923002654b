#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <flyball/control/pid_design.hpp>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball {

namespace {

using classical::TransferFunction;
using Complex = std::complex<double>;

/// K Π(T s + 1)/(s^m Π(τ s + 1)) e^{-θs}: real lags, leads and inverse responses.
struct Lags {
  double gain = 0.0;
  int integrators = 0;
  std::vector<double> lags;   ///< τ, decreasing.
  std::vector<double> leads;  ///< T > 0
  double delay = 0.0;         ///< Inverse responses are in it.
};

Refusal no_rule(std::string_view what, Complex place) {
  return refusal(PidDesignError::no_rule, "half_rule", "a pole")
      .got(std::string(what))
      .expected("real and stable, or at the origin")
      .hint("tune by a stated robustness or by the loop's shape")
      .with("pole", {place.real(), place.imag()});
}

/// The value at the origin of p without its roots there. @param z  Of a polynomial in z at z = 1,
/// divided by T^m.
double rest_at_origin(const Eigen::VectorXd& p, int roots, const std::optional<Time>& period) {
  Eigen::VectorXd q = p;
  for (int k = 0; k < roots; ++k) {
    if (period) {  // divided by (z - 1)/T
      for (Eigen::Index i = 1; i < q.size(); ++i) {
        q(i) += q(i - 1);
      }
      q = Eigen::VectorXd(q.head(q.size() - 1) * period->si());
    } else {
      q = Eigen::VectorXd(q.head(q.size() - 1));
    }
  }
  return period ? q.sum() : q(q.size() - 1);
}

/// -d ln G/ds at s = 0 of what has no pole there: how long things take, by the first moments.
double residence(const Eigen::VectorXd& p, int roots, const std::optional<Time>& period) {
  Eigen::VectorXd q = p;
  for (int k = 0; k < roots; ++k) {
    for (Eigen::Index i = 1; i < q.size(); ++i) {
      q(i) += q(i - 1);
    }
    q = Eigen::VectorXd(q.head(q.size() - 1));
  }
  double slope = 0.0;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    slope += static_cast<double>(q.size() - 1 - i) * q(i);
  }
  return period->si() * slope / q.sum();
}

Expected<Lags> lags_of(const TransferFunction& plant) {
  constexpr std::string_view where = "half_rule";
  Lags found;
  found.delay = plant.delay();
  FLYBALL_TRY_IN(where, const auto poles, plant.poles());
  const auto& period = plant.period();
  for (const Complex& pole : poles) {
    const double size = period ? 1.0 : std::max(std::abs(pole), 1e-300);
    // Repeated ones come out as pairs, apart by the roots of rounding.
    if (std::abs(pole.imag()) > 1e-2 * size) {
      return no_rule("complex", pole);
    }
    const double p = pole.real();
    if (period ? std::abs(p - 1.0) < 1e-9 : p == 0.0) {
      ++found.integrators;
    } else if (period ? p < 0.0 || p > 1.0 : p > 0.0) {
      return no_rule(period && p < 0.0 ? "negative" : "unstable", pole);
    } else if (period ? p > 0.0 : true) {
      found.lags.push_back(period ? -period->si() / std::log(p) : -1.0 / p);
    }
  }
  std::sort(found.lags.rbegin(), found.lags.rend());
  if (found.integrators > 2) {
    return no_rule("the third at the origin", 0.0);
  }
  if (plant.is_zero()) {
    return refusal(PidDesignError::no_rule, where, "the plant").got("zero");
  }
  if (period) {
    // Zeros have no simple images: what the lags leave of the residence time is delay.
    found.gain = rest_at_origin(plant.num(), 0, period) /
                 rest_at_origin(plant.den(), found.integrators, period);
    double late =
        residence(plant.den(), found.integrators, period) - residence(plant.num(), 0, period);
    for (const double lag : found.lags) {
      late -= lag;
    }
    // (z - 1)/T is s half a period later.
    late += 0.5 * period->si() * static_cast<double>(found.integrators);
    found.delay += std::max(0.0, late);
    return found;
  }
  FLYBALL_TRY_IN(where, const auto zeros, plant.zeros());
  int at_origin = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(zeros.size()); ++k) {
    const Complex zero = zeros(static_cast<Eigen::Index>(k));
    if (zero == 0.0) {
      ++at_origin;
      continue;
    }
    if (std::abs(zero.imag()) > 1e-2 * std::abs(zero)) {
      // A pair counts by its sum.
      const double sum = -(1.0 / zero).real();
      found.delay += std::max(0.0, -sum);
      continue;
    }
    const double lead = -1.0 / zero.real();
    if (lead > 0.0) {
      found.leads.push_back(lead);
    } else {
      found.delay -= lead;
    }
  }
  if (at_origin > 0) {
    return refusal(PidDesignError::no_rule, where, "the plant")
        .got("without gain at rest: it has a zero at the origin")
        .hint("tune by a stated robustness or by the loop's shape");
  }
  found.gain =
      plant.num()(plant.num().size() - 1) / rest_at_origin(plant.den(), found.integrators, period);
  return found;
}

/// (T s + 1)/(τ s + 1) ≈ k, or k/(τ' s + 1): Skogestad's rules T1 to T3. @param tau_c  Of the loop.
void cancel(Lags& model, double lead, double tau_c) {
  if (model.lags.empty()) {
    return;
  }
  // The lag just above; the largest where all are below.
  std::size_t at = 0;
  for (std::size_t i = 0; i < model.lags.size(); ++i) {
    at = model.lags[i] >= lead ? i : at;
  }
  const double lag = model.lags[at];
  const auto erase = [&] {
    model.lags.erase(model.lags.begin() + static_cast<std::ptrdiff_t>(at));
  };
  if (lead >= lag) {
    model.gain *= lag >= tau_c ? lead / lag : lead >= tau_c ? lead / tau_c : 1.0;
    erase();
    return;
  }
  if (lead >= 5.0 * tau_c) {
    model.gain *= lead / lag;
    erase();
    return;
  }
  const double nearer = std::min(lag, 5.0 * tau_c);
  if (nearer <= lead) {
    erase();
    return;
  }
  model.gain *= nearer / lag;
  model.lags[at] = nearer - lead;
  std::sort(model.lags.rbegin(), model.lags.rend());
}

}  // namespace

Expected<LagModel> half_rule(const TransferFunction& plant, int order) {
  if (order < 1 || order > 2) {
    return refusal(ArgumentError::out_of_range, "half_rule", "the order")
        .got(std::to_string(order))
        .expected("1 or 2");
  }
  FLYBALL_TRY(Lags lags, lags_of(plant));
  // The closed loop is about as fast as what is not cancelled: the delay, or the lags neglected.
  double tau_c = lags.delay;
  const auto first = static_cast<std::size_t>(std::max(0, order - lags.integrators));
  for (std::size_t i = first; i < lags.lags.size(); ++i) {
    tau_c += lags.lags[i] * (i == first ? 0.5 : 1.0);
  }
  std::sort(lags.leads.rbegin(), lags.leads.rend());
  for (const double lead : lags.leads) {
    cancel(lags, lead, tau_c);
  }
  LagModel model{.gain = lags.gain, .delay = lags.delay};
  std::vector<double> all(static_cast<std::size_t>(lags.integrators), infinity);
  all.insert(all.end(), lags.lags.begin(), lags.lags.end());
  const auto kept = static_cast<std::size_t>(order);
  if (static_cast<std::size_t>(lags.integrators) > kept) {
    return refusal(PidDesignError::no_rule, "half_rule", "the plant")
        .got("a double integrator")
        .expected("of one integrator, for a model of one lag")
        .hint("take PID");
  }
  if (all.size() > kept) {
    // Half of the largest that is neglected to the smallest that is kept, all but an integrator's.
    const double half = 0.5 * all[kept];
    if (std::isfinite(all[kept - 1])) {
      all[kept - 1] += half;
    } else {
      // An integrator takes none: K/(s (τ s + 1)) ≈ K e^{-τs}/s.
      model.delay += half;
    }
    model.delay += half;
    for (std::size_t i = kept + 1; i < all.size(); ++i) {
      model.delay += all[i];
    }
  }
  model.time_constant = all.empty() ? 0.0 : all[0];
  model.second_time_constant = order == 2 && all.size() > 1 ? all[1] : 0.0;
  return model;
}

Expected<PidLoop> tune_simc(const TransferFunction& plant, PidForm form, double closed_loop_time,
                            double filter_ratio) {
  constexpr std::string_view where = "tune_simc";
  FLYBALL_CHECK(Checks(where)
                    .not_negative(closed_loop_time, "closed_loop_time", "s")
                    .not_negative(filter_ratio, "the filter ratio"));
  if (form != PidForm::pi && form != PidForm::pid) {
    return refusal(PidDesignError::no_rule, where, "the form")
        .got(form == PidForm::p ? "P" : "PD")
        .expected("PI or PID");
  }
  FLYBALL_TRY_IN(where, const LagModel model, half_rule(plant, form == PidForm::pi ? 1 : 2));
  const double tau_c = closed_loop_time > 0.0 ? closed_loop_time : model.delay;
  const double theta = tau_c + model.delay;
  if (!(theta > 0.0)) {
    return refusal(ArgumentError::not_positive, where, "closed_loop_time")
        .got("zero, as is the model's delay")
        .expected("positive: a plant of so little lag may be made as fast as is wanted");
  }
  // In series form.
  double gain = 0.0;
  double integral = 4.0 * theta;
  double derivative = model.second_time_constant;
  if (std::isinf(model.second_time_constant)) {
    gain = 1.0 / (4.0 * model.gain * theta * theta);
    derivative = 4.0 * theta;
  } else if (std::isinf(model.time_constant)) {
    gain = 1.0 / (model.gain * theta);
  } else if (model.time_constant > 0.0) {
    gain = model.time_constant / (model.gain * theta);
    integral = std::min(model.time_constant, 4.0 * theta);
  } else {
    // A gain and a delay: an integral alone, K_c/T_i = 1/(K (τ_c + θ)).
    FLYBALL_TRY_IN(where, auto loop,
                   assess_pid(plant, {0.0, 1.0 / (model.gain * theta), 0.0}, 0.0));
    return loop;
  }
  PidGains gains{gain * (1.0 + derivative / integral), gain / integral, gain * derivative};
  const double time = gains.kd / gains.kp;
  FLYBALL_TRY_IN(where, auto loop,
                 assess_pid(plant, gains, filter_ratio > 0.0 ? time / filter_ratio : 0.0));
  if (!loop.margins.stable) {
    return refusal(PidDesignError::unstable_loop, where, "the closed loop")
        .got("unstable")
        .hint("a longer closed_loop_time: the plant is not much like its model")
        .with("unstable poles", static_cast<double>(loop.margins.unstable_poles));
  }
  return loop;
}

}  // namespace flyball
