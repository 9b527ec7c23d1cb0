! SPDX-License-Identifier: MIT
!> The normal law of a joint: its stress at a closure.
!>
!> Linear, sigma = k v at the closure v, or the hyperbola of Bandis, Lumsden and Barton (1983) with the initial
!> stiffness k and the largest closure vm,
!>
!>     stress
!>       ^              :
!>       |            / : vm
!>       |          /   :          sigma = k v/(1 - v/vm)
!>       |       _/     :
!>       |___---        :          v = sigma/(k + sigma/vm)
!>       +--------------:--> v
!>
!> Loading and unloading follow the same curve; in tension, while a bond holds, it is the line of stiffness k. Beyond
!> 0.999 vm, where the stress is 999 k vm, it continues along its tangent, so that a trial motion may pass vm.
!>
!> All is per initial stiffness here: a stress is a length, an energy its square.
module rockdda_contact_normal_law
   use rockdda_base_kinds, only : wp
   use rockdda_model_analysis_input, only : joint_material_type
   use rockdda_model_options, only : is_set
   implicit none
   private
   public :: normal_law_type, place_type, linear_law, new_normal_law

   type :: normal_law_type
      logical :: penalty = .false.               !! the stiffness is none of the joint, but a penalty on overlap
      real(wp) :: largest = huge(1.0_wp)         !! vm [length]; huge: linear
   contains
      procedure :: is_curved
      procedure :: is_stiff_at
      procedure :: secant
      procedure :: tangent
      procedure :: at
      procedure :: cuts
   end type normal_law_type

   type(normal_law_type), parameter :: linear_law = normal_law_type()

   !> Stress, tangent and energy at a gap.
   type :: place_type
      real(wp) :: stress = 0      !! compression positive [length]
      real(wp) :: tangent = 0     !! of the stress by the closure [-]
      real(wp) :: energy = 0      !! [length^2]
   end type place_type

   !> Share of vm at which the curve continues along its tangent.
   real(wp), parameter :: end_of_curve = 0.999_wp

contains

   !> Law of a joint material. A joint without a stiffness of its own has that of the run by length.
   elemental type(normal_law_type) function new_normal_law(material, by_length) result(law)
      type(joint_material_type), intent(in) :: material
      logical, intent(in) :: by_length
      law%penalty = by_length .and. material%edge_bears .and. .not. material%normal_stiffness > 0
      if (is_set(material%maximum_closure)) law%largest = material%maximum_closure
   end function new_normal_law

   !> Is the law not linear?
   elemental logical function is_curved(self)
      class(normal_law_type), intent(in) :: self
      is_curved = self%largest < huge(1.0_wp)
   end function is_curved

   !> Has the law more than four times the stiffness at one gap than at another one?
   elemental logical function is_stiff_at(self, gap, other)
      class(normal_law_type), intent(in) :: self
      real(wp), intent(in) :: gap, other    !! [length]
      real(wp) :: least
      ! beyond the end of the curve it stays
      least = (1 - end_of_curve)*self%largest
      is_stiff_at = self%is_curved() .and. max(least, self%largest + gap) < 0.5_wp*max(least, self%largest + other)
   end function is_stiff_at

   !> Stiffness by which a row with a force is compressed: force over closure. That of a linear law is k_n, to the last
   !> bit.
   elemental real(wp) function secant(self, k_n, force)
      class(normal_law_type), intent(in) :: self
      real(wp), intent(in) :: k_n           !! initial one [force/length]
      real(wp), intent(in) :: force         !! compression positive
      secant = k_n + max(force, 0.0_wp)/self%largest
   end function secant

   !> Stiffness of a row against a change of its force.
   elemental real(wp) function tangent(self, k_n, force)
      class(normal_law_type), intent(in) :: self
      real(wp), intent(in) :: k_n           !! initial one [force/length]
      real(wp), intent(in) :: force         !! compression positive
      tangent = k_n
      if (k_n > 0) tangent = k_n*(1 + max(force, 0.0_wp)/(k_n*self%largest))**2
   end function tangent

   !> The law at a gap.
   elemental type(place_type) function at(self, gap) result(place)
      class(normal_law_type), intent(in) :: self
      real(wp), intent(in) :: gap           !! [length]
      real(wp) :: v, u, w
      v = -gap
      place = place_type(v, 1.0_wp, 0.5_wp*v**2)
      if (gap >= 0 .or. .not. self%is_curved()) return
      associate (vm => self%largest)
         u = min(v/vm, end_of_curve)
         w = 1 - u
         place%stress = min(v, end_of_curve*vm)/w
         place%tangent = 1/w**2
         place%energy = vm**2*energy_of(u)
         v = v - end_of_curve*vm
         if (.not. v > 0) return
         place%energy = place%energy + (place%stress + 0.5_wp*place%tangent*v)*v
         place%stress = place%stress + place%tangent*v
      end associate
   end function at

   !> Shares 0 ... 1 of a stretch with these gaps at its ends, both <= 0, between which the tangent changes by a factor
   !> of 2 at most.
   pure function cuts(self, ends)
      class(normal_law_type), intent(in) :: self
      real(wp), intent(in) :: ends(2)       !! [length]
      real(wp), allocatable :: cuts(:)
      real(wp) :: w(2), low, high
      integer :: i, n
      w = 1 + min(ends, 0.0_wp)/self%largest
      cuts = [0.0_wp, 1.0_wp]
      high = maxval(w)
      if (.not. (high > minval(w) .and. high > 1 - end_of_curve)) return
      low = max(minval(w), 1 - end_of_curve)
      n = max(1, ceiling(2*log(high/low)/log(2.0_wp) - 1.0e-9_wp))
      cuts = [(low*(high/low)**(real(i, wp)/n), i=0, n)]
      ! what is beyond the end of the curve
      if (minval(w) < low) cuts = [minval(w), cuts]
      cuts(1) = minval(w)
      cuts(size(cuts)) = high
      cuts = (cuts - w(1))/(w(2) - w(1))
      if (w(1) > w(2)) cuts = cuts(size(cuts):1:-1)
   end function cuts

   !> Energy over vm^2 at the closure u vm: -u - ln(1 - u), for a small u by its series.
   elemental real(wp) function energy_of(u) result(energy)
      real(wp), intent(in) :: u
      real(wp) :: power
      integer :: i
      if (u > 0.1_wp) then
         energy = -u - log(1 - u)
         return
      end if
      energy = 0
      power = u
      do i = 2, 16
         power = power*u
         energy = energy + power/i
      end do
   end function energy_of

end module rockdda_contact_normal_law
