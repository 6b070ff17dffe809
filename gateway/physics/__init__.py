"""What the regulator knows of the bench and the truck: motor, road load, virtual truck (pure)."""
