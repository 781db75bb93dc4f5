/// @return rad, counter-clockwise from the world's x axis to the device's, in (-pi, pi]
double heading() const { return Transform{{}, orientation}.heading(); }
