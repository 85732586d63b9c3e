# Stiffness: ten slabs on one another.
set terminal pngcairo size 560,320 font "sans,9"
set output out
set datafile separator ","
set grid lc rgb "#dddddd"
set key top right

set datafile separator whitespace
set title "Ten slabs on one another, 1 s"
set logscale x
set logscale y
set format x "10^{%L}"
set format y "10^{%L}"
set xlabel "Young's modulus (Pa)"
set ylabel "lowering of the top (m)"
set y2label "steps of the solver"
set y2tics
set ytics nomirror
set key top center
plot data."/stiffness.txt" using 1:2 skip 1 with linespoints lc rgb "#1f77b4" title "lowering", \
     data."/stiffness.txt" using 1:3 skip 1 axes x1y2 with linespoints lc rgb "#d62728" title "steps"
