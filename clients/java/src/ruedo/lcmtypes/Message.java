package ruedo.lcmtypes;

import lcm.lcm.LCMEncodable;

/**
 * What all message types here can do: they are LCM's, too, so that {@code lcm.publish(channel,
 * message)} of LCM's own library takes them.
 */
public interface Message extends LCMEncodable {}
