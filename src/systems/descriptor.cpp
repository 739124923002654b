#include <flyball/systems/descriptor.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/constants.hpp"
#include "core/format.hpp"
#include "core/try.hpp"
#include "math/dense/dense.hpp"

namespace flyball {

namespace {

using Complex = std::complex<double>;
using detail::product;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Expected<void> check(const DescriptorSystem& s, std::string_view where) {
  const Index n = s.A.rows();
  FLYBALL_CHECK(check_system_or_gain(ContinuousSystem<>{s.A, s.B, s.C, s.D}, where));
  return Checks(where).shape(s.E, n, n, "E", "states x states").finite(s.E, "E");
}

double rate_of(const DescriptorSystem& s) {
  const double e = s.E.norm();
  const double a = s.A.norm();
  return e > 0.0 && a > 0.0 ? a / e : 1.0;
}

/// A real point away from every pole, and (s₀E - A)⁻¹[E, B] there.
struct Resolvent {
  double point = 0.0;
  MatrixXd M;
  MatrixXd B;
};

Expected<Resolvent> resolvent_of(const DescriptorSystem& s, std::string_view where) {
  const Index n = s.A.rows();
  if (n == 0) {
    return Resolvent{0.0, s.E, s.B};
  }
  MatrixXd right(n, n + s.B.cols());
  right << s.E, s.B;
  double best = 0.0;
  Resolvent found;
  for (const double factor : {1.0, -0.618, 2.718, -0.271, 0.09, -7.3}) {
    const double point = factor * rate_of(s);
    MatrixXd pencil = point * s.E - s.A;
    // Rows in units of their own.
    MatrixXd scaled = right;
    for (Index i = 0; i < n; ++i) {
      const double size = pencil.row(i).norm();
      if (size > 0.0) {
        pencil.row(i) /= size;
        scaled.row(i) /= size;
      }
    }
    double rcond = 0.0;
    const MatrixXd solved = detail::solve_linear(pencil, scaled, &rcond);
    if (rcond > best && solved.allFinite()) {
      best = rcond;
      found = {point, solved.leftCols(n), solved.rightCols(s.B.cols())};
    }
  }
  if (!(best > 10.0 * epsilon)) {
    return refusal(SystemError::singular_transform, where, "the pencil sE - A")
        .got("singular for every s")
        .expected("regular: one solution for each input")
        .hint("an equation is missing, or one follows from the others")
        .with("reciprocal condition", best);
  }
  return found;
}

/// M^ν with the ν from which its rank falls no more; its range and its kernel.
struct Split {
  MatrixXd T;        ///< n x n: the range of M^ν, then its kernel.
  Index finite = 0;  ///< How many columns are of the range.
  int index = 0;     ///< ν
};

Split split_of(const MatrixXd& M) {
  const Index n = M.rows();
  Split split;
  split.finite = n;
  split.T = MatrixXd::Identity(n, n);
  if (n == 0) {
    return split;
  }
  // M restricted to the range of its last power, V: its rank tells how much is lost at the next.
  const double small = 1e3 * epsilon * static_cast<double>(n);
  const double size = std::max(M.norm(), 1e-300);
  MatrixXd range = MatrixXd::Identity(n, n);
  while (range.cols() > 0) {
    const detail::SingularValues svd = detail::svd_of(product(M, range));
    const Index rank = (svd.values.array() > small * size).count();
    if (rank == range.cols()) {
      break;
    }
    ++split.index;
    range = MatrixXd(svd.U.leftCols(rank));
  }
  // The kernel of M^ν, one power at a time: M N_k lies in N_{k-1}.
  const Index r = range.cols();
  if (r == n) {
    return split;
  }
  MatrixXd null(n, 0);
  for (int power = 0; power < split.index; ++power) {
    // x with M x in the last kernel: (I - N Nᵀ) M x = 0.
    MatrixXd left = M;
    if (null.cols() > 0) {
      left -= product(null, detail::transposed_product(null, M));
    }
    const detail::SingularValues svd = detail::svd_of(left);
    const Index rank = (svd.values.array() > small * size).count();
    null = svd.V.rightCols(n - rank);
  }
  split.finite = r;
  if (null.cols() != n - r) {
    split.T.resize(0, 0);
    return split;
  }
  split.T.leftCols(r) = range;
  split.T.rightCols(n - r) = null;
  return split;
}

Refusal undecided(std::string_view where) {
  return refusal(SystemError::no_convergence, where, "the number of poles at infinity")
      .got("not decided: a singular value is neither zero nor not")
      .hint("write the equations in units in which their entries are near one");
}

VectorXd without_leading_zeros(const VectorXd& p) {
  Index first = 0;
  while (first + 1 < p.size() && p(first) == 0.0) {
    ++first;
  }
  return p.tail(p.size() - first);
}

}  // namespace

Expected<DescriptorAnalysis> analyze_descriptor(const DescriptorSystem& system) {
  constexpr std::string_view where = "analyze_descriptor";
  FLYBALL_CHECK(check(system, where));
  FLYBALL_TRY(const Resolvent at, resolvent_of(system, where));
  const Split split = split_of(at.M);
  if (split.T.rows() != system.A.rows()) {
    return undecided(where);
  }
  DescriptorAnalysis found;
  found.index = split.index;
  found.infinite = system.A.rows() - split.finite;
  // On the part that (s₀E - A)⁻¹E does not map to zero it has the eigenvalues 1/(s₀ - λ).
  const Index r = split.finite;
  if (r > 0) {
    const MatrixXd M = detail::solve_linear(split.T, product(at.M, split.T)).topLeftCorner(r, r);
    found.poles = at.point - detail::eigenvalues_of(M).cwiseInverse().array();
  }
  if (!found.poles.allFinite()) {
    return refusal(SystemError::no_convergence, where, "the poles")
        .got("not found: the iteration for the eigenvalues did not end");
  }
  std::sort(found.poles.begin(), found.poles.end(), [](Complex a, Complex b) {
    return a.real() != b.real() ? a.real() > b.real() : a.imag() > b.imag();
  });
  return found;
}

Expected<MatrixXcd> transfer_at(const DescriptorSystem& system, Complex s) {
  constexpr std::string_view where = "transfer_at";
  FLYBALL_CHECK(check(system, where));
  FLYBALL_CHECK(Checks(where).finite(s.real(), "the point").finite(s.imag(), "the point"));
  if (system.A.size() == 0) {
    return MatrixXcd(system.D.cast<Complex>());
  }
  MatrixXcd pencil = s * system.E.cast<Complex>() - system.A.cast<Complex>();
  MatrixXcd right = system.B.cast<Complex>();
  for (Index i = 0; i < pencil.rows(); ++i) {
    const double size = pencil.row(i).norm();
    if (size > 0.0) {
      pencil.row(i) /= size;
      right.row(i) /= size;
    }
  }
  double rcond = 0.0;
  const MatrixXcd x = detail::solve_complex(pencil, right, &rcond);
  if (rcond == 0.0 || !x.allFinite()) {
    return refusal(SystemError::no_image, where, "the point")
        .got("a pole")
        .with("point", std::vector<double>{s.real(), s.imag()});
  }
  return MatrixXcd(detail::complex_product(system.C.cast<Complex>(), x) + system.D.cast<Complex>());
}

Expected<DescriptorParts> descriptor_parts(const DescriptorSystem& system) {
  constexpr std::string_view where = "descriptor_parts";
  FLYBALL_CHECK(check(system, where));
  FLYBALL_TRY(const Resolvent at, resolvent_of(system, where));
  const Split split = split_of(at.M);
  const Index n = system.A.rows();
  if (split.T.rows() != n) {
    return undecided(where);
  }
  const Index r = split.finite;
  const Index m = system.B.cols();
  DescriptorParts parts;
  parts.proper = {MatrixXd(0, 0), MatrixXd(0, m), MatrixXd(system.C.rows(), 0), system.D};
  if (n == 0) {
    return parts;
  }
  // (s₀E - A)⁻¹ times the equations: M x' = (s₀M - I) x + B u, M = T diag(M_f, N) T⁻¹.
  MatrixXd right(n, n + m);
  right << product(at.M, split.T), at.B;
  const MatrixXd solved = detail::solve_linear(split.T, right);
  const MatrixXd CT = product(system.C, split.T);
  const MatrixXd M_f = solved.topLeftCorner(r, r);
  const MatrixXd N = solved.block(r, r, n - r, n - r);
  MatrixXd both(r, r + m);
  both << MatrixXd::Identity(r, r), solved.topRightCorner(r, m);
  // x' = (s₀I - M_f⁻¹) x + M_f⁻¹B u.
  const MatrixXd standard = r > 0 ? detail::solve_linear(M_f, both) : MatrixXd(0, m);
  parts.proper.A = -standard.leftCols(r);
  parts.proper.A.diagonal().array() += at.point;
  parts.proper.B = standard.rightCols(m);
  parts.proper.C = CT.leftCols(r);
  // (I + (s - s₀)N) x = B u: x = Σ (-N)ᵏ(s - s₀)ᵏB u.
  const Index degree = std::max(0, split.index - 1);
  std::vector<MatrixXd> powers(static_cast<std::size_t>(degree + 1),
                               MatrixXd::Zero(system.C.rows(), m));
  MatrixXd term = solved.bottomRightCorner(n - r, m);
  const double size = CT.norm() * term.norm();
  for (Index k = 0; k <= degree; ++k) {
    const MatrixXd c = product(CT.rightCols(n - r), term);
    // (s - s₀)ᵏ by its powers of s.
    double choose = 1.0;
    for (Index j = 0; j <= k; ++j) {
      powers[static_cast<std::size_t>(j)] +=
          choose * std::pow(-at.point, static_cast<double>(k - j)) * c;
      choose *= static_cast<double>(k - j) / static_cast<double>(j + 1);
    }
    term = -product(N, term);
  }
  parts.proper.D += powers.front();
  powers.erase(powers.begin());
  const double rate = rate_of(system);
  const auto vanishes = [&](const MatrixXd& P, Index power) {
    return P.norm() * std::pow(rate, static_cast<double>(power)) <=
           1e-12 * std::max(size, parts.proper.D.norm());
  };
  while (!powers.empty() && vanishes(powers.back(), static_cast<Index>(powers.size()))) {
    powers.pop_back();
  }
  parts.powers = std::move(powers);
  return parts;
}

Expected<ContinuousSystem<>> to_standard(const DescriptorSystem& system) {
  FLYBALL_TRY(DescriptorParts parts, descriptor_parts(system));
  if (!parts.powers.empty()) {
    return refusal(SystemError::no_image, "to_standard", "the transfer matrix")
        .got(detail::format("improper: it grows like s^{}", parts.powers.size()))
        .expected("proper")
        .hint("a standard system does not differentiate; add a pole that ends it");
  }
  return std::move(parts.proper);
}

Expected<DescriptorSystem> to_descriptor(const ContinuousSystem<>& system) {
  FLYBALL_CHECK(check_system_or_gain(system, "to_descriptor"));
  const Index n = system.A.rows();
  return DescriptorSystem{MatrixXd::Identity(n, n), system.A, system.B, system.C, system.D};
}

Expected<DescriptorSystem> to_descriptor(const VectorXd& num, const VectorXd& den) {
  constexpr std::string_view where = "to_descriptor";
  for (const auto& [p, name] :
       {std::pair<const VectorXd&, const char*>{num, "num"}, {den, "den"}}) {
    if (p.size() == 0) {
      return refusal(ArgumentError::empty, where, name).got("empty");
    }
    FLYBALL_CHECK(check_finite(MatrixXd(p), where, name));
  }
  const VectorXd d = without_leading_zeros(den);
  VectorXd rest = without_leading_zeros(num);
  if (d(0) == 0.0) {
    return refusal(SystemError::zero_transfer, where, "den")
        .got("zero")
        .expected("a polynomial with a coefficient that is not zero");
  }
  // num = q den + rest.
  const Index n = d.size() - 1;
  const Index more = std::max<Index>(0, rest.size() - d.size());
  VectorXd q = VectorXd::Zero(more + 1);
  if (rest.size() < d.size()) {
    rest = (VectorXd(n + 1) << VectorXd::Zero(n + 1 - rest.size()), rest).finished();
  }
  for (Index i = 0; i <= more; ++i) {
    q(i) = rest(i) / d(0);
    rest.segment(i, n + 1) -= q(i) * d;
  }
  const VectorXd r = rest.tail(n);
  // Controllable canonical form beside N x' = x - e u, of which x_k is the k-th derivative of -u.
  const Index chain = more > 0 ? more + 1 : 0;
  const Index all = n + chain;
  DescriptorSystem s{MatrixXd::Identity(all, all), MatrixXd::Identity(all, all),
                     MatrixXd::Zero(all, 1), MatrixXd::Zero(1, all),
                     MatrixXd::Constant(1, 1, chain > 0 ? 0.0 : q(0))};
  s.A.topLeftCorner(n, n).setZero();
  for (Index k = 0; k < n; ++k) {
    s.A(0, k) = -d(k + 1) / d(0);
    s.C(0, k) = r(k) / d(0);
    if (k > 0) {
      s.A(k, k - 1) = 1.0;
    }
  }
  if (n > 0) {
    s.B(0, 0) = 1.0;
  }
  s.E.bottomRightCorner(chain, chain).setZero();
  for (Index k = 0; k < chain; ++k) {
    if (k > 0) {
      s.E(n + k, n + k - 1) = 1.0;  // x_{k-1}' = x_k
    } else {
      s.B(n, 0) = -1.0;  // 0 = x₀ - u
    }
    s.C(0, n + k) = q(more - k);
  }
  return s;
}

Expected<DescriptorSystem> inverse(const DescriptorSystem& system) {
  constexpr std::string_view where = "inverse";
  FLYBALL_CHECK(check(system, where));
  const Index n = system.A.rows();
  const Index m = system.B.cols();
  if (system.C.rows() != m) {
    return refusal(ArgumentError::wrong_shape, where, "the number of outputs")
        .got(std::to_string(system.C.rows()))
        .expected(detail::format("{}, as there are inputs", m));
  }
  DescriptorSystem turned{MatrixXd::Zero(n + m, n + m), MatrixXd(n + m, n + m),
                          MatrixXd::Zero(n + m, m), MatrixXd::Zero(m, n + m), MatrixXd::Zero(m, m)};
  turned.E.topLeftCorner(n, n) = system.E;
  turned.A << system.A, system.B, system.C, system.D;
  turned.B.bottomRows(m) = -MatrixXd::Identity(m, m);
  turned.C.rightCols(m).setIdentity();
  FLYBALL_TRY_IN(where, [[maybe_unused]] const Resolvent at, resolvent_of(turned, where));
  return turned;
}

Expected<DescriptorSystem> series(const DescriptorSystem& first, const DescriptorSystem& second) {
  constexpr std::string_view where = "series";
  FLYBALL_CHECK(check(first, where));
  FLYBALL_CHECK(check(second, where));
  if (second.B.cols() != first.C.rows()) {
    return refusal(ArgumentError::wrong_shape, where, "the number of the second's inputs")
        .got(std::to_string(second.B.cols()))
        .expected(detail::format("{}, the first's outputs", first.C.rows()));
  }
  const Index n = first.A.rows();
  const Index k = second.A.rows();
  DescriptorSystem both;
  both.E = MatrixXd::Zero(n + k, n + k);
  both.E.topLeftCorner(n, n) = first.E;
  both.E.bottomRightCorner(k, k) = second.E;
  both.A = MatrixXd::Zero(n + k, n + k);
  both.A.topLeftCorner(n, n) = first.A;
  both.A.bottomRightCorner(k, k) = second.A;
  both.A.bottomLeftCorner(k, n) = product(second.B, first.C);
  both.B.resize(n + k, first.B.cols());
  both.B << first.B, product(second.B, first.D);
  both.C.resize(second.C.rows(), n + k);
  both.C << product(second.D, first.C), second.C;
  both.D = product(second.D, first.D);
  return both;
}

}  // namespace flyball
