double x() const { return position[0]; }  ///< @return m
double y() const { return position[1]; }  ///< @return m
double heading() const;  ///< @return rad, counter-clockwise from the world's x axis, in (-pi, pi]
