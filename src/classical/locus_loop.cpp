#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <flyball/systems/system_error.hpp>

#include "classical/locus_loop.hpp"
#include "classical/whole_periods.hpp"
#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"

namespace flyball::classical::detail {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// Π(s - root)^times in 31 digits. @param roots  With their exact conjugates.
Polynomial expanded(const std::vector<MultipleRoot>& roots) {
  Polynomial p = polynomial(VectorXd::Ones(1));
  const auto square = [](double x) {
    const Polynomial one = polynomial(VectorXd::Constant(1, x));
    return times(one, one);
  };
  for (const MultipleRoot& root : roots) {
    if (root.at.imag() < 0.0) {
      continue;
    }
    Polynomial factor = polynomial(Eigen::Vector2d(1.0, -root.at.real()));
    if (root.at.imag() > 0.0) {
      factor = plus(polynomial(Eigen::Vector3d(1.0, -2.0 * root.at.real(), 0.0)), 1.0,
                    plus(square(root.at.real()), 1.0, square(root.at.imag())));
    }
    for (int i = 0; i < root.times; ++i) {
      p = times(p, factor);
    }
  }
  return p;
}

/// Clusters of roots that are chained by distances up to a share of what `scale` says of them;
/// those that touch their mirror image are real.
template <class Scale>
std::vector<MultipleRoot> clusters(const VectorXcd& roots, double share, const Scale& scale) {
  std::vector<Complex> left(roots.begin(), roots.end());
  std::vector<MultipleRoot> found;
  while (!left.empty()) {
    std::vector<Complex> cluster{left.back()};
    left.pop_back();
    for (std::size_t i = 0; i < cluster.size(); ++i) {
      for (std::size_t j = 0; j < left.size();) {
        if (std::abs(left[j] - cluster[i]) <= share * std::max(scale(left[j]), scale(cluster[i]))) {
          cluster.push_back(left[j]);
          left[j] = left.back();
          left.pop_back();
        } else {
          ++j;
        }
      }
    }
    Complex mean = 0.0;
    bool above = false;
    bool below = false;
    for (const Complex& root : cluster) {
      mean += root / static_cast<double>(cluster.size());
      above = above || root.imag() >= 0.0;
      below = below || root.imag() <= 0.0;
    }
    if (above && below) {
      mean = {mean.real(), 0.0};
    }
    if (above) {
      found.push_back({mean, static_cast<int>(cluster.size())});
      if (!below) {
        found.push_back({std::conj(mean), static_cast<int>(cluster.size())});
      }
    }
  }
  return found;
}

/// The means of clusters, better: a root of multiplicity m is a simple one of the (m-1)-th
/// derivative.
void refine(std::vector<MultipleRoot>& roots, const Polynomial& p, double share) {
  for (MultipleRoot& root : roots) {
    if (root.times < 2 || root.at == 0.0) {
      continue;
    }
    Polynomial q = p;
    for (int i = 1; i < root.times; ++i) {
      q = derivative(q);
    }
    const VectorXd above = q.rounded();
    const VectorXd below = derivative(q).rounded();
    for (int i = 0; i < 4; ++i) {
      const Complex step = value(above, root.at) / value(below, root.at);
      if (!(std::abs(step) <= share * std::abs(root.at))) {
        break;
      }
      root.at -= root.at.imag() == 0.0 ? Complex(step.real()) : step;
    }
  }
}

double magnitude(Complex s) {
  return std::abs(s);
}

int count_of(const std::vector<MultipleRoot>& roots) {
  int sum = 0;
  for (const MultipleRoot& root : roots) {
    sum += root.times;
  }
  return sum;
}

/// Whether roots multiply out to a polynomial, but for rounding of its coefficients.
bool agrees(const std::vector<MultipleRoot>& roots, const Polynomial& p) {
  const VectorXd wanted = p.rounded();
  if (count_of(roots) + 1 != wanted.size()) {
    return false;
  }
  const VectorXd made = wanted(0) * expanded(roots).rounded();
  // The coefficients if all roots were negative: what their rounding is a share of.
  std::vector<MultipleRoot> sizes;
  for (const MultipleRoot& root : roots) {
    sizes.push_back({-std::abs(root.at), root.times});
  }
  const VectorXd scale = std::abs(wanted(0)) * expanded(sizes).rounded();
  const double bound = 4.0 * epsilon * static_cast<double>(wanted.size());
  return ((made - wanted).cwiseAbs().array() <= bound * scale.array()).all();
}

void sort_by_place(std::vector<MultipleRoot>& roots) {
  std::sort(roots.begin(), roots.end(), [](const MultipleRoot& a, const MultipleRoot& b) {
    return a.at.real() != b.at.real() ? a.at.real() < b.at.real() : a.at.imag() > b.at.imag();
  });
}

/// What stands in both, taken out of both.
std::vector<Complex> taken_out(std::vector<MultipleRoot>& zeros, std::vector<MultipleRoot>& poles,
                               double size) {
  std::vector<Complex> both;
  for (MultipleRoot& zero : zeros) {
    for (MultipleRoot& pole : poles) {
      const bool one = (zero.at.imag() > 0.0) == (pole.at.imag() > 0.0) &&
                       (zero.at.imag() < 0.0) == (pole.at.imag() < 0.0) &&
                       std::abs(zero.at - pole.at) <= 1e-13 * size;
      const int times = one ? std::min(zero.times, pole.times) : 0;
      both.insert(both.end(), static_cast<std::size_t>(times), pole.at);
      zero.times -= times;
      pole.times -= times;
    }
  }
  const auto gone = [](const MultipleRoot& root) { return root.times == 0; };
  std::erase_if(zeros, gone);
  std::erase_if(poles, gone);
  return both;
}

/// The rest, once the roots are known. @param roots  In s.
Expected<LocusLoop> finished(std::vector<MultipleRoot> zeros, std::vector<MultipleRoot> poles,
                             double gain, std::optional<Time> period) {
  constexpr int most = 100;
  LocusLoop loop;
  loop.period = period;
  loop.gain = gain;
  double size = 0.0;
  for (const auto* roots : {&zeros, &poles}) {
    for (const MultipleRoot& root : *roots) {
      size = std::max(size, std::abs(root.at));
    }
  }
  if (count_of(poles) > most || gain == 0.0) {
    return refusal(ArgumentError::out_of_range, "root_locus", gain == 0.0 ? "L" : "L's order")
        .got(gain == 0.0 ? std::string("zero") : flyball::detail::format("{}", count_of(poles)))
        .expected(gain == 0.0 ? std::string("a function: nothing moves with the gain")
                              : flyball::detail::format("at most {}", most));
  }
  if (count_of(poles) == 0) {
    return refusal(ArgumentError::out_of_range, "root_locus", "L")
        .got("a constant")
        .expected("a function with poles: of a constant there is no locus");
  }
  loop.fixed = taken_out(zeros, poles, size);
  if (!period) {
    // About the geometric mean of what is not zero.
    double sum = 0.0;
    int seen = 0;
    for (const auto* roots : {&zeros, &poles}) {
      for (const MultipleRoot& root : *roots) {
        if (root.at != 0.0) {
          sum += root.times * std::log2(std::abs(root.at));
          seen += root.times;
        }
      }
    }
    loop.unit = seen > 0 ? static_cast<int>(std::lround(sum / seen)) : 0;
  }
  for (auto* roots : {&zeros, &poles}) {
    for (MultipleRoot& root : *roots) {
      root.at = {std::ldexp(root.at.real(), -loop.unit), std::ldexp(root.at.imag(), -loop.unit)};
    }
    sort_by_place(*roots);
  }
  loop.zeros = std::move(zeros);
  loop.poles = std::move(poles);
  loop.gain = std::ldexp(gain, loop.unit * (loop.zero_count() - loop.pole_count()));
  loop.num = times(expanded(loop.zeros), polynomial(VectorXd::Constant(1, loop.gain)));
  loop.den = expanded(loop.poles);
  if (!std::isfinite(loop.gain) || loop.gain == 0.0 || !loop.num.all_finite() ||
      !loop.den.all_finite()) {
    return refusal(ArgumentError::out_of_range, "root_locus", "the coefficients of L")
        .got("beyond the range of a double")
        .hint("choose a unit of time in which the poles are nearer to 1");
  }
  return loop;
}

/// times/(s - root)
Complex divided(double times, Complex s, Complex root) {
  const double x = s.real() - root.real();
  const double y = s.imag() - root.imag();
  const double share = times / (x * x + y * y);
  return {share * x, -share * y};
}

/// a b, without the tests for infinities of the operator.
Complex product_of(Complex a, Complex b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

}  // namespace

std::vector<MultipleRoot> grouped(const VectorXcd& roots, const Polynomial& p) {
  for (double share = 0.03; share > 1e-13; share /= 3.0) {
    auto found = clusters(roots, share, magnitude);
    if (static_cast<Index>(found.size()) == roots.size()) {
      break;
    }
    refine(found, p, share);
    if (agrees(found, p)) {
      return found;
    }
  }
  // Apart, in exact pairs; equal ones are one.
  return clusters(roots, 1e-14, magnitude);
}

Complex LocusLoop::at(Complex s) const {
  // Factors above and below by turns, so that no part of the product overflows.
  Complex product = gain;
  std::size_t z = 0;
  std::size_t p = 0;
  int z_left = zeros.empty() ? 0 : zeros[0].times;
  int p_left = poles.empty() ? 0 : poles[0].times;
  while (z < zeros.size() || p < poles.size()) {
    if (p < poles.size() && (z >= zeros.size() || std::norm(product) > 1.0)) {
      product = product_of(product, divided(1.0, s, poles[p].at));
      if (--p_left == 0 && ++p < poles.size()) {
        p_left = poles[p].times;
      }
    } else {
      product = product_of(product, s - zeros[z].at);
      if (--z_left == 0 && ++z < zeros.size()) {
        z_left = zeros[z].times;
      }
    }
  }
  return product;
}

LocusLoop::Slopes LocusLoop::slopes(Complex s) const {
  Slopes sum{0.0, 0.0};
  for (const MultipleRoot& root : zeros) {
    sum.zeros += divided(root.times, s, root.at);
  }
  for (const MultipleRoot& root : poles) {
    sum.poles += divided(root.times, s, root.at);
  }
  return sum;
}

Complex LocusLoop::log_derivative(Complex s, int k) const {
  Complex sum = 0.0;
  for (const auto& [roots, sign] : {std::pair(&zeros, 1.0), std::pair(&poles, -1.0)}) {
    for (const MultipleRoot& root : *roots) {
      const Complex inverse = divided(1.0, s, root.at);
      Complex power = inverse;
      double factor = sign * root.times;
      for (int i = 1; i < k; ++i) {
        power = product_of(power, inverse);
        factor *= -static_cast<double>(i);
      }
      sum += factor * power;
    }
  }
  return sum;
}

Complex LocusLoop::rest(const MultipleRoot& root, bool is_pole) const {
  LocusLoop others;
  others.zeros = zeros;
  others.poles = poles;
  others.gain = gain;
  std::erase_if(is_pole ? others.poles : others.zeros,
                [&](const MultipleRoot& other) { return other.at == root.at; });
  return others.at(root.at);
}

LocusLoop::AtInfinity LocusLoop::at_infinity() const {
  // ln L = ln gain + Σ_j (Σ p^j - Σ z^j)/(j s^j).
  const int most = zero_count() + pole_count();
  const double reach = size();
  std::vector<Complex> z_powers(zeros.size(), 1.0);
  std::vector<Complex> p_powers(poles.size(), 1.0);
  for (int j = 1; j <= most; ++j) {
    Complex sum = 0.0;
    for (std::size_t i = 0; i < zeros.size(); ++i) {
      z_powers[i] *= zeros[i].at;
      sum -= z_powers[i] * static_cast<double>(zeros[i].times);
    }
    for (std::size_t i = 0; i < poles.size(); ++i) {
      p_powers[i] *= poles[i].at;
      sum += p_powers[i] * static_cast<double>(poles[i].times);
    }
    if (std::abs(sum.real()) > 1e-12 * most * std::pow(reach, j)) {
      return {j, sum.real() / j};
    }
  }
  return {};
}

double LocusLoop::size() const {
  double largest = 0.0;
  for (const auto* roots : {&zeros, &poles}) {
    for (const MultipleRoot& root : *roots) {
      largest = std::max(largest, std::abs(root.at));
    }
  }
  return largest > 0.0 ? largest : 1.0;
}

double LocusLoop::room(const MultipleRoot& root) const {
  double nearest = size();
  for (const auto* roots : {&zeros, &poles}) {
    for (const MultipleRoot& other : *roots) {
      if (other.at != root.at) {
        nearest = std::min(nearest, std::abs(other.at - root.at));
      }
    }
  }
  return nearest;
}

Expected<LocusLoop> locus_loop(const TransferFunction& given) {
  if (!given.period() && given.delay() > 0.0) {
    return refusal(TransferError::delay_in_loop, "root_locus", "the loop's dead time")
        .got(flyball::detail::format("{} s", given.delay()))
        .expected("none: with it there are infinitely many branches")
        .hint(
            "put a Padé approximation in its place (flyball solve pade), or look at bode and "
            "nyquist, where it is exact");
  }
  if (given.is_zero()) {
    return finished({}, {{0.0, 1}}, 0.0, given.period());
  }
  FLYBALL_TRY(const VectorXcd zeros, given.zeros());
  FLYBALL_TRY(const VectorXcd poles, given.poles());
  auto z = grouped(zeros, polynomial(given.num()));
  auto p = grouped(poles, polynomial(given.den()));
  if (given.period()) {
    const auto late = static_cast<int>(detail::periods_in(given.delay(), given.period()));
    if (late > 0) {
      const auto at_zero =
          std::find_if(p.begin(), p.end(), [](const MultipleRoot& r) { return r.at == 0.0; });
      if (at_zero == p.end()) {
        p.push_back({0.0, late});
      } else {
        at_zero->times += late;
      }
    }
  }
  return finished(std::move(z), std::move(p), given.num()(0) / given.den()(0), given.period());
}

Expected<LocusLoop> locus_loop(const VectorXcd& zeros, const VectorXcd& poles, double gain,
                               std::optional<Time> period) {
  // Eigenvalues of a matrix: equal only where they are.
  return finished(clusters(zeros, 1e-9, magnitude), clusters(poles, 1e-9, magnitude), gain, period);
}

std::vector<MultipleRoot> stationary_points(const LocusLoop& loop) {
  // Q = Π_distinct (s - root) (ln L)': Aberth's method on its factors. Q'/Q is
  // Σ_distinct 1/(s - root) + (ln L)''/(ln L)'.
  std::vector<MultipleRoot> features = loop.zeros;
  features.insert(features.end(), loop.poles.begin(), loop.poles.end());
  const int excess = loop.pole_count() - loop.zero_count();
  const int lost = excess != 0 ? 1 : 1 + loop.at_infinity().order;
  const int degree = static_cast<int>(features.size()) - lost;
  if (degree <= 0 || (excess == 0 && lost == 1)) {
    return {};
  }
  std::vector<Complex> s;
  for (int i = 0; i < degree; ++i) {
    // Beside a root each, to where its nearest neighbour is not.
    const MultipleRoot& root = features[static_cast<std::size_t>(i)];
    s.push_back(root.at + std::polar(0.3 * loop.room(root), 0.7 + 2.4 * i));
  }
  constexpr int most_sweeps = 400;
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    bool moved = false;
    for (std::size_t i = 0; i < s.size(); ++i) {
      Complex slope = 0.0;
      for (const MultipleRoot& root : features) {
        slope += divided(1.0, s[i], root.at);
      }
      for (std::size_t j = 0; j < s.size(); ++j) {
        if (j != i && s[j] != s[i]) {
          slope -= divided(1.0, s[i], s[j]);
        }
      }
      const Complex first = loop.log_derivative(s[i], 1);
      if (first == 0.0) {
        continue;
      }
      const Complex step = 1.0 / (slope + loop.log_derivative(s[i], 2) / first);
      if (!std::isfinite(step.real()) || !std::isfinite(step.imag())) {
        s[i] += std::polar(1e-9 * loop.size(), static_cast<double>(sweep));
        moved = true;
        continue;
      }
      s[i] -= step;
      moved = moved || std::abs(step) > 8.0 * epsilon * (std::abs(s[i]) + 1e-12 * loop.size());
    }
    if (!moved) {
      break;
    }
  }
  // Multiple ones spread by roots of the rounding; the mean of a cluster does not.
  const auto room = [&](Complex at) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const MultipleRoot& root : features) {
      nearest = std::min(nearest, std::abs(root.at - at));
    }
    return nearest;
  };
  VectorXcd all = Eigen::Map<const VectorXcd>(s.data(), static_cast<Index>(s.size()));
  for (Complex& at : all) {
    if (std::abs(at.imag()) < 1e-10 * room(at)) {
      at = at.real();
    }
  }
  std::vector<MultipleRoot> points = clusters(all, 1e-5, room);
  for (MultipleRoot& point : points) {
    if (point.times == 1) {
      const Complex step = loop.log_derivative(point.at, 1) / loop.log_derivative(point.at, 2);
      if (std::abs(step) < 1e-5 * room(point.at)) {
        point.at -= point.at.imag() == 0.0 ? Complex(step.real()) : step;
      }
    }
  }
  return points;
}

}  // namespace flyball::classical::detail
