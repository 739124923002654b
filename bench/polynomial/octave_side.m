% Octave's side of bench_polynomial: arx of the records in the file named on the command line, one
% JSON object a line; the smallest processor time of five calls in microseconds, then the
% coefficients of A and B after their leading ones.
pkg load control
file = fopen (argv (){1});
while (ischar (line = fgetl (file)))
  r = jsondecode (line);
  data = iddata (r.y(:), r.u(:), 0.01);
  best = Inf;
  for k = 1:5
    start = cputime ();
    sys = arx (data, "na", r.a, "nb", r.b);
    best = min (best, cputime () - start);
  endfor
  [num, den] = filtdata (sys(1, 1), "vector");
  num(end + 1 : r.b + 1) = 0;
  den(end + 1 : r.a + 1) = 0;
  printf ("%.3f", best * 1e6);
  printf (" %.17g", den(2 : r.a + 1), num(2 : r.b + 1));
  printf ("\n");
endwhile
