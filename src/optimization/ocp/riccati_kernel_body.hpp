#pragma once

// The recursion over stages, in the namespace FLYBALL_VARIANT.

namespace flyball::optimization::detail::FLYBALL_VARIANT {

namespace {

template <std::size_t Lanes>
struct Vector;
template <>
struct Vector<4> {
  using Pack = double __attribute__((vector_size(32), aligned(8), may_alias));
};
template <>
struct Vector<8> {
  using Pack = double __attribute__((vector_size(64), aligned(8), may_alias));
};

/// Rows of Packs packs of Lanes numbers; 0: as many packs as the system says.
template <std::size_t Lanes, std::size_t Packs>
struct Rows {
  using Pack = typename Vector<Lanes>::Pack;
  static constexpr std::size_t packs(std::size_t width) {
    return Packs > 0 ? Packs : width / Lanes;
  }
  /// y += a x
  static void add(double* y, double a, const double* x, std::size_t width) {
    auto* const to = reinterpret_cast<Pack*>(y);
    const auto* const from = reinterpret_cast<const Pack*>(x);
    for (std::size_t i = 0; i < packs(width); ++i) {
      to[i] += a * from[i];
    }
  }
  static void scale(double* y, double a, const double* x, std::size_t width) {
    auto* const to = reinterpret_cast<Pack*>(y);
    const auto* const from = reinterpret_cast<const Pack*>(x);
    for (std::size_t i = 0; i < packs(width); ++i) {
      to[i] = a * from[i];
    }
  }
};

/// P ← (P⁻¹ + D)⁻¹ and E = (I + P D)⁻¹, by elimination in [I + S P S | S P], S² = D.
/// @return whether I + S P S is positive definite.
template <class Row>
bool soften(double* P, double* E, const double* D, std::size_t n, std::size_t width,
            double* scratch) {
  double* const M = scratch;
  double* const X = scratch + n * width;
  double* const s = scratch + 2 * n * width;
  for (std::size_t i = 0; i < n; ++i) {
    s[i] = __builtin_sqrt(D[i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    Row::scale(X + i * width, s[i], P + i * width, width);
    for (std::size_t j = 0; j < width; ++j) {
      M[i * width + j] = j < n ? X[i * width + j] * s[j] : 0.0;
    }
    M[i * width + i] += 1.0;
  }
  // M X = S P, by LDLᵀ without pivoting: M is positive definite or the factorisation ends.
  for (std::size_t j = 0; j < n; ++j) {
    const double pivot = M[j * width + j];
    if (!(pivot > 1e-14)) {
      return false;
    }
    for (std::size_t i = j + 1; i < n; ++i) {
      const double factor = M[i * width + j] / pivot;
      Row::add(M + i * width, -factor, M + j * width, width);
      Row::add(X + i * width, -factor, X + j * width, width);
    }
  }
  for (std::size_t j = n; j-- > 0;) {
    for (std::size_t i = j + 1; i < n; ++i) {
      Row::add(X + j * width, -M[j * width + i], X + i * width, width);
    }
    Row::scale(X + j * width, 1.0 / M[j * width + j], X + j * width, width);
  }
  // X = M⁻¹ S P:  P̃ = P - (S P)ᵀ X,  E = I - P S M⁻¹ S = I - Xᵀ S.
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < width; ++j) {
      E[i * width + j] = j < n ? (i == j ? 1.0 : 0.0) - X[j * width + i] * s[j] : 0.0;
    }
  }
  // P̃ = E P.
  double* const Q = M;
  for (std::size_t i = 0; i < n; ++i) {
    Row::scale(Q + i * width, 0.0, Q + i * width, width);
    for (std::size_t j = 0; j < n; ++j) {
      Row::add(Q + i * width, E[i * width + j], P + j * width, width);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      P[i * width + j] = 0.5 * (Q[i * width + j] + Q[j * width + i]);
    }
  }
  return true;
}

/// @tparam States, Inputs  The system's, where known: loops become straight lines; 0, 0: any.
template <class Row, std::size_t States, std::size_t Inputs>
bool factor_rows(const StageSystem& s) {
  const std::size_t n = States > 0 ? States : s.states;
  const std::size_t size = States > 0 ? States + Inputs : n + s.inputs;
  const std::size_t width = s.width;
  double* const M = s.scratch;
  double* const W = s.scratch + size * width;
  for (std::size_t k = s.stages; k-- > 0;) {
    const unsigned char* const fixed = s.fixed + k * size;
    const double* const diagonal = s.diagonal + k * size;
    // M = H + diag + Gᵀ w G + [A B]ᵀ P [A B]
    for (std::size_t i = 0; i < size; ++i) {
      if (s.H != nullptr) {
        Row::scale(M + i * width, 1.0, s.H + (k * size + i) * width, width);
      } else {
        for (std::size_t j = 0; j < width; ++j) {
          M[i * width + j] = 0.0;
        }
      }
      M[i * width + i] += diagonal[i];
    }
    for (std::size_t r = s.first_row[k]; r < s.first_row[k + 1]; ++r) {
      const double* const g = s.G + r * width;
      for (std::size_t i = 0; i < size; ++i) {
        if (g[i] != 0.0) {
          Row::add(M + i * width, s.weight[r] * g[i], g, width);
        }
      }
    }
    if (k + 1 < s.stages) {
      const double* const AB = s.AB + k * n * width;
      const double* const P = s.P + (k + 1) * n * width;
      for (std::size_t i = 0; i < n; ++i) {
        Row::scale(W + i * width, P[i * width], AB, width);
        for (std::size_t j = 1; j < n; ++j) {
          Row::add(W + i * width, P[i * width + j], AB + j * width, width);
        }
      }
      for (std::size_t a = 0; a < size; ++a) {
        for (std::size_t j = 0; j < n; ++j) {
          Row::add(M + a * width, AB[j * width + a], W + j * width, width);
        }
      }
    }
    // Inputs, and at the first stage states, are eliminated: last first.
    double* const L = s.L + k * size * width;
    double* const pivots = s.pivots + k * size;
    const std::size_t end = k == 0 ? 0 : n;
    for (std::size_t j = size; j-- > end;) {
      if (fixed[j] != 0) {
        continue;
      }
      const double pivot = M[j * width + j];
      // What elimination left must be more than its rounding.
      if (!(pivot > 1e-300) || !(pivot < 1e300)) {
        return false;
      }
      pivots[j] = 1.0 / pivot;
      Row::scale(L + j * width, pivots[j], M + j * width, width);
      for (std::size_t i = 0; i < j; ++i) {
        Row::add(M + i * width, -M[i * width + j], L + j * width, width);
      }
    }
    if (k == 0) {
      continue;
    }
    double* const P = s.P + k * n * width;
    bool any_fixed = false;
    for (std::size_t i = 0; i < n; ++i) {
      Row::scale(P + i * width, 1.0, M + i * width, width);
      for (std::size_t j = n; j < size; ++j) {
        P[i * width + j] = 0.0;
      }
      any_fixed = any_fixed || fixed[i] != 0;
    }
    const double* const D = s.D + (k - 1) * n;
    if (any_fixed) {
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n && fixed[i] != 0; ++j) {
          P[i * width + j] = 0.0;
          P[j * width + i] = 0.0;
        }
      }
    }
    if (s.soft && !soften<Row>(P, s.E + k * n * width, D, n, width, s.scratch)) {
      return false;
    }
    if (any_fixed) {
      for (std::size_t i = 0; i < n; ++i) {
        if (fixed[i] != 0) {
          P[i * width + i] = 1.0 / D[i];
        }
      }
    }
  }
  return true;
}

/// y += a x, of `size` numbers: scalars that were just written are not read as a vector.
inline void add_few(double* y, double a, const double* x, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    y[i] += a * x[i];
  }
}

template <class Row, std::size_t States, std::size_t Inputs>
void solve_rows(const StageSystem& s, const StageVectors& v) {
  constexpr bool few = States > 0;
  const std::size_t n = few ? States : s.states;
  const std::size_t size = few ? States + Inputs : n + s.inputs;
  const std::size_t width = s.width;
  double small_y[few ? States : 1];
  double small_q[few ? States + Inputs : 1];
  double* const y = few ? small_y : s.scratch;  // A z + b and the like
  double* const q = few ? small_q : s.scratch + width;
  const auto add = [&](double* to, double a, const double* x) {
    if constexpr (few) {
      add_few(to, a, x, States + Inputs);
    } else {
      Row::add(to, a, x, width);
    }
  };
  for (std::size_t k = s.stages; k-- > 0;) {
    const unsigned char* const fixed = s.fixed + k * size;
    for (std::size_t i = 0; i < size; ++i) {
      q[i] = v.h[k * size + i];
    }
    for (std::size_t i = size; i < width && !few; ++i) {
      q[i] = 0.0;
    }
    for (std::size_t r = s.first_row[k]; r < s.first_row[k + 1]; ++r) {
      add(q, v.e[r], s.G + r * width);
    }
    if (k + 1 < s.stages) {
      const double* const AB = s.AB + k * n * width;
      const double* const P = s.P + (k + 1) * n * width;
      const double* const p = v.p + (k + 1) * n;
      const double* const b = v.b + k * n;
      for (std::size_t i = 0; i < n; ++i) {
        double sum = p[i];
        for (std::size_t j = 0; j < n; ++j) {
          sum += P[i * width + j] * b[j];
        }
        add(q, sum, AB + i * width);
      }
    }
    double* const g = v.g + k * size;
    const auto eliminate = [&](std::size_t j) {
      if (fixed[j] == 0) {
        const double q_j = q[j];
        g[j] = q_j * s.pivots[k * size + j];
        add(q, -q_j, s.L + (k * size + j) * width);
      }
    };
    for (std::size_t j = size; j-- > n;) {
      eliminate(j);
    }
    if (k == 0) {
      for (std::size_t j = n; j-- > 0;) {
        eliminate(j);
      }
    }
    if (k == 0) {
      continue;
    }
    double* const p = v.p + k * n;
    if (s.soft) {
      const double* const E = s.E + k * n * width;
      for (std::size_t i = 0; i < n; ++i) {
        q[i] = fixed[i] != 0 ? 0.0 : q[i];
      }
      for (std::size_t i = 0; i < n; ++i) {
        double sum = 0.0;
        for (std::size_t j = 0; j < n; ++j) {
          sum += E[i * width + j] * q[j];
        }
        p[i] = sum;
      }
    } else {
      for (std::size_t i = 0; i < n; ++i) {
        p[i] = fixed[i] != 0 ? 0.0 : q[i];
      }
    }
  }
  for (std::size_t k = 0; k < s.stages; ++k) {
    const unsigned char* const fixed = s.fixed + k * size;
    double* const z = v.dz + k * size;
    const auto recover = [&](std::size_t j) {
      double sum = -v.g[k * size + j];
      const double* const L = s.L + (k * size + j) * width;
      for (std::size_t a = 0; a < j; ++a) {
        sum -= L[a] * z[a];
      }
      z[j] = fixed[j] != 0 ? 0.0 : sum;
    };
    if (k == 0) {
      for (std::size_t j = 0; j < n; ++j) {
        recover(j);
      }
    }
    for (std::size_t j = n; j < size; ++j) {
      recover(j);
    }
    if (k + 1 == s.stages) {
      break;
    }
    const double* const AB = s.AB + k * n * width;
    const double* const P = s.P + (k + 1) * n * width;
    const unsigned char* const next_fixed = s.fixed + (k + 1) * size;
    for (std::size_t i = 0; i < n; ++i) {
      double sum = v.b[k * n + i];
      for (std::size_t a = 0; a < size; ++a) {
        sum += AB[i * width + a] * z[a];
      }
      y[i] = sum;
    }
    for (std::size_t i = 0; i < n; ++i) {
      double sum = v.p[(k + 1) * n + i];
      for (std::size_t j = 0; j < n; ++j) {
        sum += P[i * width + j] * y[j];
      }
      v.dl[k * n + i] = sum;
      const double next = s.soft ? y[i] - s.D[k * n + i] * sum : y[i];
      v.dz[(k + 1) * size + i] = next_fixed[i] != 0 ? 0.0 : next;
    }
  }
}

template <class Work>
auto with_sizes(const StageSystem& system, Work&& work) {
  const auto is = [&](std::size_t states, std::size_t inputs) {
    return system.states == states && system.inputs == inputs;
  };
  if (is(1, 1)) {
    return work.template operator()<Rows<4, 1>, 1, 1>();
  }
  if (is(2, 1)) {
    return work.template operator()<Rows<4, 1>, 2, 1>();
  }
  if (is(4, 1)) {
    return work.template operator()<Rows<8, 1>, 4, 1>();
  }
  if (is(4, 2)) {
    return work.template operator()<Rows<8, 1>, 4, 2>();
  }
  switch (system.width) {
    case 4:
      return work.template operator()<Rows<4, 1>, 0, 0>();
    case 8:
      return work.template operator()<Rows<8, 1>, 0, 0>();
    case 16:
      return work.template operator()<Rows<8, 2>, 0, 0>();
    case 24:
      return work.template operator()<Rows<8, 3>, 0, 0>();
    default:
      return work.template operator()<Rows<8, 0>, 0, 0>();
  }
}

}  // namespace

bool factor_stages(const StageSystem& system) noexcept {
  return with_sizes(system, [&]<class Row, std::size_t States, std::size_t Inputs>() {
    return factor_rows<Row, States, Inputs>(system);
  });
}

void solve_stages(const StageSystem& system, const StageVectors& vectors) noexcept {
  with_sizes(system, [&]<class Row, std::size_t States, std::size_t Inputs>() {
    solve_rows<Row, States, Inputs>(system, vectors);
  });
}

}  // namespace flyball::optimization::detail::FLYBALL_VARIANT
